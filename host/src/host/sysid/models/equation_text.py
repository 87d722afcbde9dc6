"""Write a model of equations as TOML that `equation_file.py` reads."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np

from host.sysid.models.equation_file import KIND
from host.sysid.models.fit_result import FitResult
from host.sysid.models.model_constants import OWN
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import Parameter


def equation_text(model: NonlinearModel, result: FitResult | None = None) -> str:
    """Return a model as TOML; with a result, estimates become the start values.

    Parameters
    ----------
    model : NonlinearModel
    result : FitResult, optional
        Gives start values, and a [fit] table with half-widths.
    """
    e = model.source
    lines = [
        f'kind = "{KIND}"',
        f"name = {_text(model.name)}",
        f"inputs = {_list(e.inputs[: e.controls])}",
        f"columns = {_list(e.inputs[e.controls :])}",
        f'hold = "{model.hold}"',
        f"initial_states = {_starts(model)}",
        f"state_biases = {_list(model.state_biases)}",
        f"output_biases = {_list(model.output_biases)}",
        f"process_noise = {_list(model.process_noise)}",
    ]
    if model.known_noise:
        pairs = ", ".join(f"{k} = {_plain(v)}" for k, v in model.known_noise)
        lines.append(f"noise = {{ {pairs} }}")
    lines += _section("constants", {k: _plain(v) for k, v in e.constants})
    for name, texts in (
        ("definitions", e.definitions),
        ("rates", e.rates),
        ("outputs", e.outputs),
        ("starts", e.starts),
    ):
        lines += _section(name, {k: _text(v) for k, v in texts})
    lines.append("[parameters]")
    values = {} if result is None else dict(zip(result.names, result.estimate, strict=True))
    lines += [_parameter(p, values.get(p.name, p.start), each=False) for p in model.parameters]
    lines += [_parameter(p, p.start, each=True) for p in model.own_parameters]
    for name, x, y in e.tables:
        points = {"x": _numbers(x), "y": _numbers(y)}
        lines += _section(f"tables.{name}", points)
    if result is not None:
        half = result.half_width()
        told = {
            _text(n): f"[{_plain(v)}, {_plain(h)}]"
            for n, v, h in zip(result.names, result.estimate, half, strict=True)
        }
        lines += _section("fit", {"method": _text(result.method), **told})
    for delay in model.delays:
        lines += [
            "[[delays]]",
            f"name = {_text(delay.name)}",
            f"outputs = {_list(delay.outputs)}",
            f"prior_sd_s = {_plain(delay.prior_sd_s)}",
            f"limit_s = {_plain(delay.limit_s)}",
        ]
    return "\n".join(lines) + "\n"


def _parameter(parameter: Parameter, start: float, *, each: bool) -> str:
    parts = [f"start = {_plain(start)}"]
    for key in ("lower", "upper", "prior_sd"):
        value = getattr(parameter, key)
        if np.isfinite(value):
            parts.append(f"{key} = {_plain(value)}")
    if parameter.unit:
        parts.append(f"unit = {_text(parameter.unit)}")
    if each:
        parts.append("each_record = true")
    return f"{parameter.name} = {{ {', '.join(parts)} }}"


def _starts(model: NonlinearModel) -> str:
    pairs = [f'{s} = "{OWN}"' for s in model.initial_states]
    pairs += [f"{s} = {_plain(v)}" for s, v in model.known_starts]
    pairs += [f"{s} = {_text(p)}" for s, p in model.shared_starts]
    return f"{{ {', '.join(pairs)} }}"


def _section(name: str, values: Mapping[str, str]) -> list[str]:
    if not values:
        return []
    return [f"[{name}]", *(f"{key} = {value}" for key, value in values.items())]


def _list(names: Iterable[str]) -> str:
    return f"[{', '.join(_text(n) for n in names)}]"


def _numbers(values: Iterable[float]) -> str:
    return f"[{', '.join(_plain(v) for v in values)}]"


def _plain(value: float) -> str:
    return repr(float(value))  # numpy's numbers call themselves np.float64(...)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # what JSON escapes, TOML does the same way
