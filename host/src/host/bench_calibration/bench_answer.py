"""Result of a calibration: lines for people, and the same as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.calibrated_lines import Calibrated
from host.bench_calibration.hard_iron import HardIron, rounded
from host.bench_calibration.line_fit import LineFit
from host.bench_calibration.supply_reference import SupplyReference
from host.constants import NORMAL_95

_RAW = {"channel": "counts", "pulse": "us"}


def line_report(subject: Subject, lines: Sequence[Calibrated]) -> list[str]:
    """Return lines on each channel: zero and slope with 95 % half-widths, residuals, doubts."""
    said = []
    for one in lines:
        if one.fit is not None:
            said += _line(subject, one.fit)
        if one.doubt:
            said.append(f"  not written: {one.doubt}")
        if one.short:
            said.append(f"  short: {one.short}")
    return said


def _line(subject: Subject, fit: LineFit) -> list[str]:
    tool = subject.tool
    assert tool is not None
    setting = {"m/s": "Pa", "mm": "Pa"}.get(tool.setting, tool.setting)
    per = 1.0 if tool.setting in ("mm", "m/s") else tool.value(1.0)
    unit = _RAW.get(subject.table, setting)
    scale = 1.0 if subject.table != "imu" else 1.0 / per
    zero, slope = fit.zero * scale, fit.slope / (per if subject.table != "imu" else 1.0)
    ratio = "" if subject.table == "imu" else f" {setting} per {unit.removesuffix('s')}"
    if subject.table == "pulse":
        ratio = f" {setting} per us"
    repeats = len(set(fit.repeat.tolist()))
    bend = "" if math.isnan(fit.bend) else f", bend {fit.bend * scale:.2g}"
    return [
        f"{fit.channel}: zero {zero:.5g} +- {NORMAL_95 * fit.zero_sigma * scale:.2g} {unit},"
        f" slope {slope:.5g} +- {abs(NORMAL_95 * fit.slope_sigma * slope):.2g}{ratio}"
        + (" there, and a curve" if fit.curve else ""),
        f"  residual {fit.residual * scale:.2g}, hysteresis {fit.hysteresis * scale:.2g}{bend}"
        f" {unit}; {len(fit.raw)} readings in {repeats} repeat{'s' if repeats > 1 else ''}",
    ]


def plain(subject: Subject, lines: Sequence[Calibrated]) -> dict[str, Any]:
    """Return the same for a program; SI, deviations as in the file."""
    return {
        "subject": subject.name,
        "lines": [
            {
                "channel": c.channel,
                "doubt": c.doubt,
                "short": c.short,
                **({} if c.fit is None else _numbers(c.fit)),
            }
            for c in lines
        ],
    }


def _numbers(fit: LineFit) -> dict[str, Any]:
    return {
        "zero": fit.zero,
        "slope": fit.slope,
        "zero_sigma": fit.zero_sigma,
        "slope_sigma": fit.slope_sigma,
        "residual": fit.residual,
        "hysteresis": fit.hysteresis,
        "bend": None if math.isnan(fit.bend) else fit.bend,
        "repeat_zeros": fit.repeat_zeros.tolist(),
        "readings": len(fit.raw),
        "curve": list(fit.curve),
    }


def iron_report(found: HardIron) -> list[str]:
    """Return lines on the magnetometer, with the command to type at the IMU's console."""
    centre = ", ".join(
        f"{axis} {c:.0f} +- {NORMAL_95 * s:.1g}"
        for axis, c, s in zip("xyz", found.centre, found.centre_sigma, strict=True)
    )
    said = [
        f"magnetometer: hard iron {centre} counts, radius"
        f" {', '.join(f'{r:.0f}' for r in found.radius)}, residual {found.residual:.1f}"
    ]
    if found.doubt:
        return [*said, f"  not to be used: {found.doubt}"]
    x, y, z = rounded(found.centre)
    return [*said, f"  at the IMU's console: imu iron {x} {y} {z}"]


def supply_report(found: SupplyReference) -> list[str]:
    """Return lines on the supply, with the command that stores the reference in the board."""
    said = [
        f"supply: the chip's reference is {found.reference_mv:.0f} +-"
        f" {NORMAL_95 * found.sigma_mv:.0f} mV (meter {found.meter_v:.3f} V where the status line"
        f" said {found.shown_v:.3f} V)"
    ]
    if found.doubt:
        return [*said, f"  not to be used: {found.doubt}"]
    return [
        *said,
        "  into the board's EEPROM: python hw/calibration/reference_record.py"
        f" --meter {found.meter_v:.3f} --shown {found.shown_v:.3f} reference.hex",
    ]
