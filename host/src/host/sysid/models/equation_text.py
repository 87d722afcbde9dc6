"""Write a model of equations as TOML that `equation_file.py` reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from host.export.toml import toml_number, toml_value
from host.sysid.models.equation_file import KIND, SMOOTH
from host.sysid.models.fit_result import FitResult
from host.sysid.models.model_constants import OWN
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import DelayGroup, Parameter


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
        f"name = {toml_value(model.name)}",
        f"inputs = {toml_value(e.inputs[: e.controls])}",
        f"columns = {toml_value(e.inputs[e.controls :])}",
        f'hold = "{SMOOTH if model.smooth else model.hold}"',
        f"initial_states = {_starts(model)}",
        f"state_biases = {toml_value(model.state_biases)}",
        f"output_biases = {toml_value(model.output_biases)}",
        f"process_noise = {toml_value(model.process_noise)}",
    ]
    if model.known_noise:
        pairs = ", ".join(f"{k} = {toml_number(v)}" for k, v in model.known_noise)
        lines.append(f"noise = {{ {pairs} }}")
    lines += _section("constants", {k: toml_number(v) for k, v in e.constants})
    for name, texts in (
        ("definitions", e.definitions),
        ("rates", e.rates),
        ("outputs", e.outputs),
        ("starts", e.starts),
    ):
        lines += _section(name, {k: toml_value(v) for k, v in texts})
    lines.append("[parameters]")
    values = {} if result is None else dict(zip(result.names, result.estimate, strict=True))
    lines += [_parameter(p, values.get(p.name, p.start), each=False) for p in model.parameters]
    lines += [_parameter(p, p.start, each=True) for p in model.own_parameters]
    for name, x, y in e.tables:
        points = {"x": _numbers(x), "y": _numbers(y)}
        lines += _section(f"tables.{name}", points)
    if result is not None:
        half = result.half_width()
        parts = {
            toml_value(n): f"[{toml_number(v)}, {toml_number(h)}]"
            for n, v, h in zip(result.names, result.estimate, half, strict=True)
        }
        lines += _section("fit", {"method": toml_value(result.method), **parts})
    lines += delay_lines(model.delays)
    return "\n".join(lines) + "\n"


def delay_lines(delays: Iterable[DelayGroup]) -> list[str]:
    """Return the tables of a model's delays."""
    return [
        line
        for delay in delays
        for line in (
            "[[delays]]",
            f"name = {toml_value(delay.name)}",
            f"outputs = {toml_value(delay.outputs)}",
            f"prior_sd_s = {toml_number(delay.prior_sd_s)}",
            f"limit_s = {toml_number(delay.limit_s)}",
        )
    ]


def _parameter(parameter: Parameter, start: float, *, each: bool) -> str:
    parts = [f"start = {toml_number(start)}"]
    for key in ("lower", "upper", "prior_sd"):
        value = getattr(parameter, key)
        if np.isfinite(value):
            parts.append(f"{key} = {toml_number(value)}")
    if parameter.unit:
        parts.append(f"unit = {toml_value(parameter.unit)}")
    if each:
        parts.append("each_record = true")
    return f"{parameter.name} = {{ {', '.join(parts)} }}"


def _starts(model: NonlinearModel) -> str:
    pairs = [f'{s} = "{OWN}"' for s in model.initial_states]
    pairs += [f"{s} = {toml_number(v)}" for s, v in model.known_starts]
    pairs += [f"{s} = {toml_value(p)}" for s, p in model.shared_starts]
    return f"{{ {', '.join(pairs)} }}"


def _section(name: str, values: Mapping[str, str]) -> list[str]:
    if not values:
        return []
    return [f"[{name}]", *(f"{key} = {value}" for key, value in values.items())]


def _numbers(values: Iterable[float]) -> str:
    return f"[{', '.join(toml_number(v) for v in values)}]"
