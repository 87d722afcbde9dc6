"""Read models from TOML, written by a user or by `model_text.py` after a fit.

```toml
name = "short-period"
states = ["alpha_rad", "q_radps"]
inputs = ["elevator_rad"]
outputs = ["alpha_rad", "q_radps", "az_mps2"]
hold = "foh"
state_biases = ["alpha_rad", "q_radps"]
output_biases = ["az_mps2"]
initial_states = ["alpha_rad", "q_radps"]
A = [["Z_alpha", 1.0], ["M_alpha", "M_q"]]
B = [["Z_de"], ["M_de"]]
C = [[1, 0], [0, 1], ["17.0*Z_alpha", 0]]
D = [[0], [0], ["17.0*Z_de"]]
[parameters]
Z_alpha = { start = -5.0, lower = -50.0, upper = 0.0 }
[[delays]]
name = "delay_vanes_s"
outputs = ["alpha_rad"]
[[levers]]
output = "az_mps2"
state = "q_radps"
parameter = "imu_x_m"
gain = -1.0
```

An entry is a number, a parameter, ``gain*parameter`` or a sum of those; parameters without a line
of their own start at zero. Left out, `initial_states` are all, `state_biases` those of rows with
a parameter, `output_biases` those of outputs that are no state: records hold total quantities, and
without a constant of its own the trim would pass for a derivative. `delays` are those of vanes,
IMU, attitude and pitot, with the priors of the templates. An empty list frees none. Constants that
are known, or the same in all records, and known noise: `model_constants.py`.

`kind = "equations"` says that a file holds a user's equations (`equation_file.py`), and
`kind = "coefficients"` the terms of lift, drag, side force and moments (`coefficient_model.py`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, overload

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.files.user_text import parse_toml, read_text, read_toml, shown
from host.sysid.models.coefficient_model import KIND as COEFFICIENTS
from host.sysid.models.coefficient_model import CoefficientModel, coefficients_from
from host.sysid.models.equation_file import KIND as EQUATIONS
from host.sysid.models.equation_file import equations_from, line_of
from host.sysid.models.file_parts import (
    delays_from,
    names_from,
    number_from,
    parameter_from,
    table_from,
)
from host.sysid.models.model_constants import (
    Inputs,
    ModelConstants,
    read_constants,
    read_noise,
    with_constant_input,
)
from host.sysid.models.residual_delays import delays_of
from host.sysid.models.state_space_model import (
    MATRICES,
    AccelerometerOffset,
    LinearModel,
    Parameter,
    Term,
)
from host.sysid.models.templates import Trim
from host.text import shown as in_a_line

_PIECE = re.compile(
    r"\s*(?P<sign>[+-]?)\s*(?:(?P<gain>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:\s*\*\s*(?P<scaled>[A-Za-z_]\w*))?"
    r"|(?P<name>[A-Za-z_]\w*))\s*"
)
KEYS = {
    "name", "states", "inputs", "outputs", "hold", "state_biases", "output_biases",
    "initial_states", "noise", "parameters", "delays", "levers", "fit", "trim", "thrust",
    *MATRICES,
}  # fmt: skip
_TRIM = {
    "airspeed_mps": Quantity("m/s", 0.5, 2000.0, "indoor models to the X-15"),
    "alpha_rad": Quantity("rad", -1.6, 1.6, "a quarter turn; in degrees it would be larger"),
    "theta_rad": Quantity("rad", -1.6, 1.6, "a quarter turn; in degrees it would be larger"),
}
MOST_SIGNALS = 30  # both axes together have 8 states and 14 outputs


@overload
def read_model(path: Path) -> LinearModel: ...
@overload
def read_model(path: Path, *, of_coefficients: Literal[True]) -> LinearModel | CoefficientModel: ...
def read_model(path: Path, *, of_coefficients: bool = False) -> LinearModel | CoefficientModel:
    """Read a model file: matrices, or by its `kind` equations or terms of coefficients.

    Parameters
    ----------
    path : Path
    of_coefficients : bool
        Whether terms of coefficients are a model here too.

    Raises
    ------
    IdentificationError
        If the file is no TOML or no model; the line says where.
    """
    text = read_text(path, IdentificationError, "TOML")
    document = parse_toml(text, str(path), IdentificationError)
    kind = document.get("kind")
    if kind == COEFFICIENTS and of_coefficients:
        return coefficients_from(document, str(path))
    if kind == COEFFICIENTS:
        raise IdentificationError(f"{path}: terms of coefficients, expected matrices or equations")
    if kind == EQUATIONS:
        try:
            return equations_from(document, path.stem)
        except IdentificationError as error:
            raise IdentificationError(f"{path}{line_of(str(error), text)}: {error}") from None
    for key, meant in (("rates", EQUATIONS), ("rows", COEFFICIENTS)):
        if key in document:
            raise IdentificationError(
                f'{path}: [{key}] are of {meant}; write kind = "{meant}" above'
            )
    return model_from(document, str(path))


def read_trim(path: Path) -> Trim:
    """Read the flight condition that a saved answer was linearised about.

    Raises
    ------
    IdentificationError
        If the file has none: a model that a user wrote.
    """
    table = read_toml(path, IdentificationError).get("trim", {})
    if not isinstance(table, dict) or not _TRIM.keys() <= table.keys():
        raise IdentificationError(f"{path}: no [trim] with {', '.join(_TRIM)}")
    return Trim(
        *(q.check(f"{path}: trim.{k}", table[k], IdentificationError) for k, q in _TRIM.items())
    )


def model_from(document: Mapping[str, object], source: str = "model") -> LinearModel:
    """Build a model from a parsed document."""
    signals = _signals(document, source)
    n, m, p = (len(signals[key]) for key in ("states", "inputs", "outputs"))
    shapes = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
    fixed: dict[str, Array] = {}
    terms: list[Term] = []
    for label, shape in shapes.items():
        fixed[label], found = _matrix(document.get(label), label, shape, signals, source)
        terms += found
    accelerometer_offsets = _levers(document.get("levers", []), source)
    constants = _constants(document, signals, terms, source)
    starts, rates = constants["initial_states"], constants["state_biases"]
    inputs = with_constant_input(
        Inputs(signals["inputs"], fixed["B"], fixed["D"], tuple(terms)),
        signals["states"],
        signals["outputs"],
        rates,
        constants["output_biases"],
    )
    entering = [t.parameter for t in inputs.terms] + [x.parameter for x in accelerometer_offsets]
    used = list(dict.fromkeys([*entering, *(name for _, name in starts.shared)]))
    parameters = _parameters(document.get("parameters", {}), used, source)
    return LinearModel(
        name=in_a_line(str(document.get("name", Path(source).stem))),
        states=signals["states"],
        inputs=inputs.names,
        outputs=signals["outputs"],
        A=fixed["A"],
        B=inputs.B,
        C=fixed["C"],
        D=inputs.D,
        terms=inputs.terms,
        parameters=parameters,
        state_biases=rates.own,
        output_biases=constants["output_biases"].own,
        initial_states=starts.own,
        delays=(
            delays_from(document["delays"], used, f"{source}: ")
            if "delays" in document
            else delays_of(signals["outputs"])
        ),
        hold=str(document.get("hold", "foh")),
        accelerometer_offsets=accelerometer_offsets,
        known_starts=starts.known,
        shared_starts=starts.shared,
        known_noise=read_noise(document.get("noise", {}), signals["outputs"], f"{source}: noise"),
    )


def _signals(document: Mapping[str, object], source: str) -> dict[str, tuple[str, ...]]:
    """Return states, inputs and outputs; refuse a document that is no model."""
    if not document:
        raise IdentificationError(
            f"{source}: nothing in it, expected states, inputs, outputs, A to D"
        )
    unknown_keys = sorted(set(document) - KEYS)
    if unknown_keys:
        raise IdentificationError(
            f"{source}: unknown key {', '.join(unknown_keys)}; known are {', '.join(sorted(KEYS))}"
        )
    signals = {
        key: names_from(document, key, f"{source}: ") for key in ("states", "inputs", "outputs")
    }
    if both := [name for name in signals["inputs"] if name in signals["states"]]:
        raise IdentificationError(
            f"{source}: {both[0]} is a state and an input: it may be one of them"
        )
    most = max(map(len, signals.values()))
    if most > MOST_SIGNALS:
        raise IdentificationError(
            f"{source}: {most} states, inputs or outputs, expected up to {MOST_SIGNALS}"
        )
    return signals


def _matrix(
    value: object,
    label: str,
    shape: tuple[int, int],
    signals: Mapping[str, tuple[str, ...]],
    source: str,
) -> tuple[Array, list[Term]]:
    fixed = np.zeros(shape)
    if value is None:
        if label == "C":
            for row, output in enumerate(signals["outputs"]):
                if output in signals["states"]:
                    fixed[row, signals["states"].index(output)] = 1.0
        return fixed, []
    rows = value if isinstance(value, list) else []
    if len(rows) != shape[0] or any(not isinstance(r, list) or len(r) != shape[1] for r in rows):
        raise IdentificationError(f"{source}: {label} must have {shape[0]} rows of {shape[1]}")
    terms = []
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            constant, pieces = parse_entry(entry, f"{source}: {label}[{i}][{j}]")
            fixed[i, j] = constant
            terms += [Term(label, i, j, name, gain) for name, gain in pieces]
    return fixed, terms


def parse_entry(entry: object, where: str) -> tuple[float, list[tuple[str, float]]]:
    """Return the known part and the (parameter, gain) pairs of one matrix entry."""
    if isinstance(entry, bool) or not isinstance(entry, int | float | str):
        raise IdentificationError(
            f"{where}: {shown(entry)}, expected a number or a sum of parameters"
        )
    if not isinstance(entry, str):
        return number_from(entry, where), []
    constant, pieces, position = 0.0, [], 0
    while position < max(len(entry), 1):
        found = _PIECE.match(entry, position)
        if found is None or found.end() == position or (position > 0 and not found["sign"]):
            raise IdentificationError(
                f"{where}: '{entry}' not understood; write 1.0, Z_alpha or 17.0*Z_alpha - g"
            )
        sign = -1.0 if found["sign"] == "-" else 1.0
        if found["name"]:
            pieces.append((found["name"], sign))
        elif found["scaled"]:
            pieces.append((found["scaled"], sign * float(found["gain"])))
        else:
            constant += sign * float(found["gain"])
        position = found.end()
    for number in (constant, *(gain for _, gain in pieces)):
        number_from(number, where)
    return constant, pieces


def _constants(
    document: Mapping[str, object],
    signals: Mapping[str, tuple[str, ...]],
    terms: list[Term],
    source: str,
) -> dict[str, ModelConstants]:
    """Return initial states and biases; those of keys that are left out are free."""
    free = {term.row for term in terms if term.matrix in "AB"}
    usual = {
        "initial_states": signals["states"],
        "state_biases": tuple(s for k, s in enumerate(signals["states"]) if k in free),
        "output_biases": tuple(y for y in signals["outputs"] if y not in signals["states"]),
    }
    of = {key: signals["outputs" if key == "output_biases" else "states"] for key in usual}
    return {
        key: read_constants(document[key], of[key], f"{source}: {key}")
        if key in document
        else ModelConstants(names)
        for key, names in usual.items()
    }


def _parameters(value: object, used: list[str], source: str) -> tuple[Parameter, ...]:
    if not isinstance(value, dict):
        raise IdentificationError(f"{source}: [parameters] must be a table")
    unknown = sorted(set(value) - set(used))
    if unknown:
        raise IdentificationError(
            f"{source}: parameter {', '.join(unknown)} enters no matrix; those that do are"
            f" {', '.join(used)}"
        )
    return tuple(
        parameter_from(name, value.get(name, {}), f"{source}: parameter {name}") for name in used
    )


def _levers(value: object, source: str) -> tuple[AccelerometerOffset, ...]:
    needed = ("output", "state", "parameter")
    if not isinstance(value, list):
        raise IdentificationError(f"{source}: [[levers]] must be a list of tables")
    result = []
    for item in value:
        table = table_from(item, (*needed, "gain"), f"{source}: a lever")
        names = [str(table[k]) for k in needed if isinstance(table.get(k), str)]
        if len(names) < len(needed):
            raise IdentificationError(f"{source}: a lever needs output, state and parameter")
        gain = number_from(table.get("gain", 1.0), f"{source}: lever on {names[0]}: gain")
        result.append(AccelerometerOffset(names[0], names[1], names[2], gain))
    return tuple(result)
