"""What measured thrust adds to a linear model: a column that only `predict` takes along.

A model that is flown, converted or fitted again has surfaces for inputs; thrust is in the file
next to its matrices.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.export.toml import toml_value
from host.files.quantities import Quantity
from host.files.user_text import read_toml
from host.sysid.models.state_space_model import LinearModel

THRUST = "thrust_n"
THRUST_COLUMNS = (THRUST, "power_w")  # either tells it
TABLE = "thrust"
RATES, OUTPUTS = "rates_per_n", "outputs_per_n"
_PER_N = Quantity("per N", -1e6, 1e6, "1 N on a gram is 1000 m/s2")


@dataclass(frozen=True, slots=True)
class ThrustColumn:
    """Effect per newton: on the rate of each state, (n,), and on each output directly, (p,); SI."""

    rates_per_n: Array
    outputs_per_n: Array

    def added_to(self, model: LinearModel) -> LinearModel:
        """Return the model with `THRUST` as its last input."""
        return replace(
            model,
            inputs=(*model.inputs, THRUST),
            B=np.column_stack([model.B, self.rates_per_n]),
            D=np.column_stack([model.D, self.outputs_per_n]),
        )

    def lines(self) -> list[str]:
        """Return the table of a model file."""
        rates, outputs = (list(map(float, v)) for v in (self.rates_per_n, self.outputs_per_n))
        return [
            f"[{TABLE}]",
            f"{RATES} = {toml_value(rates)}",
            f"{OUTPUTS} = {toml_value(outputs)}",
        ]


def read_thrust_column(path: Path, model: LinearModel) -> ThrustColumn | None:
    """Return what a model file says of thrust; None where it says nothing.

    Raises
    ------
    IdentificationError
        If its table is no number for each state and output of the model.
    """
    table = read_toml(path, IdentificationError).get(TABLE)
    if table is None:
        return None
    if not isinstance(table, Mapping) or set(table) != {RATES, OUTPUTS}:
        raise IdentificationError(f"{path}: [{TABLE}] is {RATES} and {OUTPUTS}, and nothing else")
    return ThrustColumn(
        _numbers(path, RATES, table[RATES], model.states),
        _numbers(path, OUTPUTS, table[OUTPUTS], model.outputs),
    )


def _numbers(path: Path, key: str, given: object, names: tuple[str, ...]) -> Array:
    if not isinstance(given, list) or len(given) != len(names):
        raise IdentificationError(
            f"{path}: {TABLE}.{key}: expected {len(names)} numbers, for {', '.join(names)}"
        )
    where = f"{path}: {TABLE}.{key}"
    return np.array([_PER_N.check(where, value, IdentificationError) for value in given])
