"""Write a model as TOML that `model_file.py` reads."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from host.sysid.models.equation_text import equation_text
from host.sysid.models.fit_result import FitResult
from host.sysid.models.model_constants import OWN
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import MATRICES, LinearModel
from host.sysid.models.templates import Trim


def model_text(
    model: LinearModel, result: FitResult | None = None, trim: Trim | None = None
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
    """
    if isinstance(model, NonlinearModel):
        return equation_text(model, result)
    lines = [f"name = {_text(model.name)}"]
    for key in ("states", "inputs", "outputs"):
        lines.append(f"{key} = {_list(getattr(model, key))}")
    lines.append(f'hold = "{model.hold}"')
    for key in ("state_biases", "output_biases"):
        lines.append(f"{key} = {_list(getattr(model, key))}")
    lines.append(f"initial_states = {_starts(model)}")
    if model.known_noise:
        lines.append(f"noise = {_table(dict(model.known_noise))}")
    if not model.delays:
        lines.append("delays = []")
    for label in MATRICES:
        matrix = getattr(model, label)
        rows = []
        for i in range(matrix.shape[0]):
            entries = [_entry(model, label, i, j) for j in range(matrix.shape[1])]
            rows.append("[" + ", ".join(entries) + "]")
        lines.append(f"{label} = [" + ", ".join(rows) + "]")
    lines.append("[parameters]")
    for k, parameter in enumerate(model.parameters):
        start = parameter.start if result is None else result.estimate[k]
        parts = [f"start = {_plain(start)}"]
        for key in ("lower", "upper", "prior_sd"):
            value = getattr(parameter, key)
            if np.isfinite(value):
                parts.append(f"{key} = {_plain(value)}")
        lines.append(f"{_text(parameter.name)} = {{ {', '.join(parts)} }}")
    if result is not None:
        lines.append("[fit]")
        lines.append(f'method = "{result.method}"')
        half = result.half_width()
        for k, name in enumerate(result.names):
            lines.append(f"{_text(name)} = [{_plain(result.estimate[k])}, {_plain(half[k])}]")
    if trim is not None and trim.known:
        lines.append("[trim]")
        for key in ("airspeed_mps", "alpha_rad", "theta_rad"):
            lines.append(f"{key} = {_plain(getattr(trim, key))}")
    for delay in model.delays:
        lines += [
            "[[delays]]",
            f"name = {_text(delay.name)}",
            f"outputs = {_list(delay.outputs)}",
            f"prior_sd_s = {_plain(delay.prior_sd_s)}",
            f"limit_s = {_plain(delay.limit_s)}",
        ]
    for lever in model.accelerometer_offsets:
        lines += [
            "[[levers]]",
            f'output = "{lever.output}"',
            f'state = "{lever.state}"',
            f'parameter = "{lever.parameter}"',
            f"gain = {_plain(lever.gain)}",
        ]
    return "\n".join(lines) + "\n"


def _plain(value: float) -> str:
    return repr(float(value))  # numpy's numbers call themselves np.float64(...)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # what JSON escapes, TOML does the same way


def _list(names: tuple[str, ...]) -> str:
    return "[" + ", ".join(_text(name) for name in names) + "]"


def _starts(model: LinearModel) -> str:
    """Return a list of the initial states that are free, a table where others are not zero."""
    others: dict[str, float | str] = {**dict(model.known_starts), **dict(model.shared_starts)}
    if not others:
        return _list(model.initial_states)
    return _table(dict.fromkeys(model.initial_states, OWN) | others)


def _table(values: Mapping[str, float | str]) -> str:
    pairs = (f"{k} = {_text(v) if isinstance(v, str) else _plain(v)}" for k, v in values.items())
    return "{ " + ", ".join(pairs) + " }"


def _entry(model: LinearModel, label: str, row: int, column: int) -> str:
    known = float(getattr(model, label)[row, column])
    pieces = [
        f"{_plain(term.gain)}*{term.parameter}"
        for term in model.terms
        if (term.matrix, term.row, term.column) == (label, row, column)
    ]
    if not pieces:
        return _plain(known)
    if known != 0.0:
        pieces.insert(0, _plain(known))
    return '"' + " + ".join(pieces).replace("+ -", "- ") + '"'
