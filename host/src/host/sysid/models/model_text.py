"""Write a model as TOML that `model_file.py` reads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.export.toml import toml_number, toml_value
from host.sysid.models.equation_text import delay_lines, equation_text
from host.sysid.models.fit_result import FitResult
from host.sysid.models.model_constants import OWN
from host.sysid.models.state_space_model import MATRICES, LinearModel, Parameter, has_equations
from host.sysid.models.templates import Trim
from host.sysid.models.thrust_column import ThrustColumn


def model_text(
    model: LinearModel,
    result: FitResult | None = None,
    trim: Trim | None = None,
    thrust: ThrustColumn | None = None,
) -> str:
    """Return a model as TOML; with a result, estimates become the start values.

    Parameters
    ----------
    model : LinearModel
        What to write.
    result : FitResult, optional
        Gives start values, and a [fit] table with standard errors.
    trim : Trim, optional
        Gives a [trim] table: the condition the model is linearised about, to fly it again.
    thrust : ThrustColumn, optional
        Gives a [thrust] table: what measured thrust adds to the model.
    """
    if has_equations(model):
        return equation_text(model, result)
    lines = [f"name = {toml_value(model.name)}"]
    for key in ("states", "inputs", "outputs"):
        lines.append(f"{key} = {toml_value(getattr(model, key))}")
    lines.append(f'hold = "{model.hold}"')
    for key in ("state_biases", "output_biases"):
        lines.append(f"{key} = {toml_value(getattr(model, key))}")
    lines.append(f"initial_states = {_starts(model)}")
    if model.known_noise:
        lines.append(f"noise = {_table(dict(model.known_noise))}")
    if not model.delays:
        lines.append("delays = []")
    lines += [_matrix(model, label) for label in MATRICES]
    lines.append("[parameters]")
    starts = model.start if result is None else result.estimate
    for parameter, start in zip(model.parameters, starts, strict=False):
        lines.append(_parameter(parameter, float(start)))
    if result is not None:
        lines.append("[fit]")
        lines.append(f'method = "{result.method}"')
        half = result.half_width()
        for k, name in enumerate(result.names):
            lines.append(
                f"{toml_value(name)} = [{toml_number(result.estimate[k])}, {toml_number(half[k])}]"
            )
    if trim is not None and trim.known:
        lines.append("[trim]")
        for key in ("airspeed_mps", "alpha_rad", "theta_rad"):
            lines.append(f"{key} = {toml_number(getattr(trim, key))}")
    if thrust is not None:
        lines += thrust.lines()
    lines += delay_lines(model.delays)
    lines += _lever_lines(model)
    return "\n".join(lines) + "\n"


def _lever_lines(model: LinearModel) -> list[str]:
    """Return the places of accelerometers that are parameters."""
    lines = []
    for offset in model.accelerometer_offsets:
        lines += [
            "[[levers]]",
            f'output = "{offset.output}"',
            f'state = "{offset.state}"',
            f'parameter = "{offset.parameter}"',
            f"gain = {toml_number(offset.gain)}",
        ]
    return lines


def _matrix(model: LinearModel, label: str) -> str:
    """Return the line of a matrix, free entries by their parameters."""
    count, width = getattr(model, label).shape
    rows = (", ".join(_entry(model, label, i, j) for j in range(width)) for i in range(count))
    return f"{label} = [" + ", ".join(f"[{row}]" for row in rows) + "]"


def _parameter(parameter: Parameter, start: float) -> str:
    """Return the line of a parameter: start, and what is known of it beforehand."""
    parts = [f"start = {toml_number(start)}"]
    for key in ("lower", "upper", "prior_sd"):
        value = getattr(parameter, key)
        if np.isfinite(value):
            parts.append(f"{key} = {toml_number(value)}")
    return f"{toml_value(parameter.name)} = {{ {', '.join(parts)} }}"


def _starts(model: LinearModel) -> str:
    """Return a list of the initial states that are free, a table where others are not zero."""
    others: dict[str, float | str] = {**dict(model.known_starts), **dict(model.shared_starts)}
    if not others:
        return toml_value(model.initial_states)
    return _table(dict.fromkeys(model.initial_states, OWN) | others)


def _table(values: Mapping[str, float | str]) -> str:
    pairs = (f"{k} = {toml_value(v)}" for k, v in values.items())
    return "{ " + ", ".join(pairs) + " }"


def _entry(model: LinearModel, label: str, row: int, column: int) -> str:
    known = float(getattr(model, label)[row, column])
    pieces = [
        f"{toml_number(term.gain)}*{term.parameter}"
        for term in model.terms
        if (term.matrix, term.row, term.column) == (label, row, column)
    ]
    if not pieces:
        return toml_number(known)
    if known != 0.0:
        pieces.insert(0, toml_number(known))
    return '"' + " + ".join(pieces).replace("+ -", "- ") + '"'
