"""The model of the original program: every entry of A and B free, every state measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.sysid.models.state_space_model import LinearModel, Parameter, Term


def free_model(
    name: str,
    states: Sequence[str],
    inputs: Sequence[str],
    *,
    start_A: Array | None = None,
    start_B: Array | None = None,
    **options: tuple[str, ...] | str,
) -> LinearModel:
    """Build the model of the original program: every entry of A and B free, states measured.

    Parameters
    ----------
    name : str
        Model name.
    states, inputs : sequence of str
        Signal names.
    start_A, start_B : Array, optional
        Start values; zero without.
    **options
        `state_biases`, `initial_states`, `hold` ... of `LinearModel`.
    """
    n, m = len(states), len(inputs)
    A0 = np.zeros((n, n)) if start_A is None else np.asarray(start_A, dtype=np.float64)
    B0 = np.zeros((n, m)) if start_B is None else np.asarray(start_B, dtype=np.float64)
    parameters, terms = [], []
    for matrix, start, columns in (("A", A0, n), ("B", B0, m)):
        for row in range(n):
            for column in range(columns):
                label = f"{matrix.lower()}{row + 1}{column + 1}"
                parameters.append(Parameter(label, float(start[row, column])))
                terms.append(Term(matrix, row, column, label))
    settings: dict[str, tuple[str, ...] | str] = {"initial_states": tuple(states), **options}
    return LinearModel(
        name=name,
        states=tuple(states),
        inputs=tuple(inputs),
        outputs=tuple(states),
        A=np.zeros((n, n)),
        B=np.zeros((n, m)),
        C=np.eye(n),
        D=np.zeros((n, m)),
        terms=tuple(terms),
        parameters=tuple(parameters),
        state_biases=_names(settings.get("state_biases", ())),
        output_biases=_names(settings.get("output_biases", ())),
        initial_states=_names(settings["initial_states"]),
        hold=str(settings.get("hold", "zoh")),
    )


def _names(value: tuple[str, ...] | str) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value)
