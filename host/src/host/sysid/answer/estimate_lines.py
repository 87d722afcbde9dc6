"""Estimates, modes and figures of fit of an answer as a table for people."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from host.constants import DEG_PER_RAD
from host.sysid.answer.constant_lines import constant_lines
from host.sysid.answer.mode_lines import linear_mode_lines, mode_lines
from host.sysid.answer.servo_lines import servo_estimate_lines
from host.sysid.answer.settling_history import history_lines
from host.sysid.models.parameter_units import parameter_unit

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer


def model_lines(answer: Answer) -> list[str]:
    """Return estimates, modes and fit as a table for people."""
    result = answer.result
    half = result.half_width()
    speed = f"{answer.condition.airspeed_mps:.2f} m/s" if answer.trim.known else "unknown airspeed"
    lines = [
        f"{answer.template} at {speed},"
        f" alpha {answer.trim.alpha_rad * DEG_PER_RAD:.1f} deg; value and 95 % half-width"
    ]
    for k, name in enumerate(answer.model.parameter_names):
        unit = parameter_unit(answer.model, name)
        lines.append(_estimate_line(answer, name, float(result.estimate[k]), float(half[k]), unit))
    lines += [_estimate_line(answer, name, *pair, "s") for name, pair in answer.delays.items()]
    lines += servo_estimate_lines(answer.servo)
    if answer.coefficients:
        lines.append(
            "  coefficients (mass, inertia, pressure, places, pots and delays in the half-width)"
        )
        lines += [
            f"  {c.name:16s} {c.value:11.5g}  +- {c.half_width:9.3g}"
            + ("" if c.differs_from_zero else "  not told from zero")
            for c in answer.coefficients
        ]
    lines += [*constant_lines(answer), *history_lines(answer), *linear_mode_lines(answer)]
    for kind, fits in (
        ("free simulation, fitted data", answer.fits),
        ("free simulation, held-out data", answer.validation),
    ):
        if fits:
            shares = ", ".join(
                f"{f.name} {100.0 * f.nrmse:.1f} %"
                if math.isfinite(f.nrmse)
                else f"{f.name} diverges"
                for f in fits
            )
            lines.append(f"  NRMSE ({kind}): {shares}")
    return lines


def _estimate_line(answer: Answer, name: str, value: float, half: float, unit: str) -> str:
    """Return one number with its half-width, and what speaks against it in a word."""
    flags = answer.identifiability_flags
    marks = [r.grade for r in flags if r.name == name and not name.startswith("imu_")]
    marks += ["at its bound"] if name in answer.at_bound else []
    text = f"  {name:16s} {value:11.5g}  +- {half:9.3g}  {unit:7s}"
    return text.rstrip() if not marks else text + "".join(f"  {mark}" for mark in marks)


def coefficient_lines(answer: CoefficientAnswer) -> list[str]:
    """Return coefficients, modes, delays and fit as a table for people."""
    flight = answer.fit.condition
    lines = [
        f"coefficients at {flight.airspeed_mps:.2f} m/s, alpha"
        f" {flight.alpha_rad * DEG_PER_RAD:.1f} deg, CL {flight.lift:.3f}; value, 95 % half-width,"
        " what widens it most"
    ]
    for d in answer.fit.derivatives:
        small = " of 5 % of the row" if d.reference > abs(d.value) else ""
        cause = answer.causes.get(d.name, ("", 0.0))[0]
        line = f"  {d.name:9s} {d.value:10.4f}  +- {d.half_width:8.4f}  {100.0 * d.share:6.1f} %"
        line += f"{small}  {cause}" + ("  flagged" if d.flagged else "")
        lines.append(line.rstrip())
    lines.append("  CD_0 is the drag at zero lift, surfaces as flown")
    lines += mode_lines(answer.modes)
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
