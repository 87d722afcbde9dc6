"""Estimates, modes and figures of fit of an answer as a table for people."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from host.constants import DEG_PER_RAD
from host.sysid.answer.constant_lines import constant_lines
from host.sysid.answer.converted_marks import converted_marks
from host.sysid.answer.marks import share_text
from host.sysid.answer.mode_lines import coefficient_modes, linear_modes, mode_lines
from host.sysid.answer.parameter_words import in_words, word_of
from host.sysid.answer.servo_lines import servo_estimate_lines
from host.sysid.answer.settling_history import history_lines
from host.sysid.models.diagnostics import reference_values
from host.sysid.models.parameter_units import parameter_unit

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from host.sysid.answer.marks import Verdict
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.diagnostics import SignalFit


def model_lines(answer: Answer, verdict: Verdict) -> list[str]:
    """Return estimates, modes and fit as a table for people."""
    result = answer.result
    half = result.half_width()
    speed = f"{answer.condition.airspeed_mps:.2f} m/s" if answer.trim.known else "unknown airspeed"
    lines = [
        f"{answer.template} at {speed},"
        f" alpha {answer.trim.alpha_rad * DEG_PER_RAD:.1f} deg; value, 95 % half-width, what widens"
        " it most"
    ]
    size = reference_values(answer.model, answer.maneuvers, result.estimate)
    for k, name in enumerate(answer.model.parameter_names):
        mark = verdict.marks.get(name, "")
        share = f"{100.0 * float(half[k]) / max(float(size[k]), 1e-300):.0f} %" if mark else ""
        known = f"{share} {word_of(mark)}" if mark else ""
        known = "at its bound" if name in answer.at_bound else known
        called = "" if answer.own_model else in_words(name)
        lines.append(
            _line(
                f"{name} {called}",
                float(result.estimate[k]),
                float(half[k]),
                parameter_unit(answer.model, name),
                known,
                answer.causes.get(name, ""),
            )
        )
    lines += [
        _line(name, *pair, "s", "at its bound" if name in answer.at_bound else "", "")
        for name, pair in answer.delays.items()
    ]
    lines += servo_estimate_lines(answer.servo)
    if answer.coefficients:
        marks = converted_marks(answer, verdict.marks)
        lines.append(
            "  coefficients (mass, inertia, pressure, places, pots and delays in the half-width)"
        )
        lines += [
            _line(
                f"{c.name} {in_words(c.name)}",
                c.value,
                c.half_width,
                "",
                f"{share_text(c.half_width / max(abs(c.value), 1e-300))} {_word(marks, c.name)}",
                c.widened_by,
            )
            for c in answer.coefficients
        ]
    lines += [*constant_lines(answer), *history_lines(answer), *mode_lines(linear_modes(answer))]
    lines += _fit_line("fitted data", answer.fits) + _fit_line("held-out data", answer.validation)
    return lines


def _fit_line(kind: str, fits: Sequence[SignalFit]) -> list[str]:
    shares = (
        f"{f.name} {100.0 * f.nrmse:.1f} %" if math.isfinite(f.nrmse) else f"{f.name} diverges"
        for f in fits
    )
    return [f"  NRMSE (free simulation, {kind}): {', '.join(shares)}"] if fits else []


def _word(marks: Mapping[str, str], name: str) -> str:
    return word_of(marks[name]) if name in marks else ""


def _line(name: str, value: float, half: float, unit: str, known: str, cause: str) -> str:
    """Return one number with its half-width, how well it is known, and what widens it most."""
    text = f"  {name.strip():25s} {value:11.5g}  +- {half:9.3g}  {unit:7s}  {known:>11s}  {cause}"
    return text.rstrip()


def coefficient_lines(answer: CoefficientAnswer, verdict: Verdict) -> list[str]:
    """Return coefficients, modes, delays and fit as a table for people."""
    flight = answer.fit.condition
    lines = [
        f"coefficients at {flight.airspeed_mps:.2f} m/s, alpha"
        f" {flight.alpha_rad * DEG_PER_RAD:.1f} deg, CL {flight.lift:.3f}; value, 95 % half-width,"
        " what widens it most"
    ]
    for d in answer.fit.derivatives:
        cause = answer.causes.get(d.name, ("", 0.0))[0]
        known = f"{share_text(d.share)} {word_of(verdict.marks[d.name])}"
        named = f"{d.name} {in_words(d.name)}"
        lines.append(_line(named, d.value, d.half_width, "", known, cause))
    lines.append("  CD_0 is the drag at zero lift, surfaces as flown")
    lines += mode_lines(coefficient_modes(answer, verdict))
    delays = ", ".join(
        f"{name.split('_')[1]} {1e3 * value:+.2f} +- {1e3 * half:.2f} ms"
        for name, (value, half) in answer.delays.items()
    )
    lines.append(f"  residual delays: {delays}")
    shares = ", ".join(f"{n} {100.0 * x.nrmse:.1f} %" for n, x in answer.fit.histories.items())
    lines.append(f"  NRMSE (one-step, fitted data, gusts in it): {shares}")
    if answer.fit.prediction is not None:
        both = answer.fit.prediction.fitted, answer.fit.prediction.left_out
        shares = ", ".join(
            f"{name} {100.0 * fitted:.1f} / {100.0 * both[1][name]:.1f} %"
            for name, fitted in both[0].items()
        )
        lines.append(f"  the same below 4.5 Hz, fitted / unseen (leave-one-out): {shares}")
    return lines
