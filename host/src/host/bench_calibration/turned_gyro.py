"""Gyros: zero at rest, slope from a turn by a known angle.

A turn's mean rate times its time is the angle, whatever the hand's speed. The zero of the rests is
subtracted first; the mean of two opposite turns removes the remainder.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from host.bench_calibration.bench_plan import Subject, Tool, hand_worth
from host.bench_calibration.calibrated_lines import Calibrated
from host.bench_calibration.line_fit import LineFit, sigma95
from host.bench_calibration.reading_table import number_of, rows_of
from host.constants import DEG_PER_RAD, RAD_PER_DEG
from host.errors import UsageError
from host.files.user_text import shown

Array = NDArray[np.float64]
RATES = ("p", "q", "r")
_RESPONSE_SHARE = 0.5  # share of the angle that the named axis must see
_OPPOSITE = -0.5


@dataclass(frozen=True, slots=True)
class Rest:
    """Mean rates while nothing moved, rad/s by the schema's scale."""

    repeat: int
    rates_radps: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Turn:
    """Mean rates of one turn about one axis by a known angle."""

    repeat: int
    axis: int
    angle_rad: float
    seconds: float
    rates_radps: tuple[float, float, float]


def read_turns(path: Path, first_repeat: int = 1) -> tuple[list[Rest], list[Turn]]:
    """Return rests and turns of a table: repeat, kind, axis, angle_deg, seconds, p_degps, ...

    Raises
    ------
    UsageError
        If a row is neither, or lacks a number.
    """
    columns = tuple(f"{rate}_degps" for rate in RATES)
    rests: list[Rest] = []
    turns: list[Turn] = []
    for index, row in enumerate(rows_of(path, ("kind", *columns)), start=2):
        p, q, r = (number_of(path, row, c, index) * RAD_PER_DEG for c in columns)
        number = number_of(path, row, "repeat", index)
        repeat = (1 if math.isnan(number) else round(number)) + first_repeat - 1
        kind = (row["kind"] or "").strip()
        if math.isnan(p + q + r):
            raise UsageError(f"{path}: row {index} needs {', '.join(columns)}")
        if kind == "rest":
            rests.append(Rest(repeat, (p, q, r)))
            continue
        axis = (row.get("axis") or "").strip().lower()
        angle = number_of(path, row, "angle_deg", index)
        seconds = number_of(path, row, "seconds", index)
        if kind != "turn" or axis not in ("x", "y", "z") or not seconds * abs(angle) > 0.0:
            raise UsageError(
                f"{path}: row {index} is {shown(kind)} {shown(axis)}, expected rest, or turn with"
                " axis x, y or z, angle_deg and seconds"
            )
        turns.append(Turn(repeat, "xyz".index(axis), angle * RAD_PER_DEG, seconds, (p, q, r)))
    return rests, turns


def gyro_lines(subject: Subject, rests: Sequence[Rest], turns: Sequence[Turn]) -> list[Calibrated]:
    """Return the line of each gyro.

    Raises
    ------
    UsageError
        Without a rest, or an axis that was not turned.
    """
    if not rests:
        raise UsageError("no rest among the gyros' readings: hold still for 10 s, then turn")
    return [_line(subject, axis, rests, turns) for axis in range(3)]


def _line(subject: Subject, axis: int, rests: Sequence[Rest], turns: Sequence[Turn]) -> Calibrated:
    rest, table = subject.tool, subject.turntable
    assert rest is not None and table is not None
    channel = RATES[axis]
    own = [t for t in turns if t.axis == axis]
    if not own:
        raise UsageError(f"gyro {channel}: no turn about {'xyz'[axis]}; turn it both ways")
    still = np.array([r.rates_radps[axis] for r in rests])
    repeats = np.array([r.repeat for r in rests])
    numbers = np.unique(repeats)
    zeros = np.array([float(still[repeats == n].mean()) for n in numbers])
    zero = float(zeros.mean())
    angle = np.array([t.angle_rad for t in own])
    seen = np.array([(np.array(t.rates_radps) - _zeros(rests)) * t.seconds for t in own])
    followed = seen[:, axis] @ angle / (angle @ angle)
    other = _other_axis(seen, angle, axis)
    if abs(followed) < _RESPONSE_SHARE or followed < 0.0:
        return Calibrated(channel, None, _axis_doubt(channel, followed, other))
    zero_sigma = _zero_sigma(rest, still, len(numbers))
    left = seen[:, axis] - followed * angle
    worth = hand_worth()
    # Both ends of a turn may be off by the play of the stop; rests give the deviation of the zero.
    word = (table.reading * RAD_PER_DEG) ** 2 + float(
        np.mean([(rest.reading * RAD_PER_DEG * t.seconds) ** 2 for t in own])
    ) / len(rests)
    free = len(own) - 1
    variance = (worth * word + float(left @ left)) / (worth + free)
    share = variance / float(angle @ angle) / followed**2
    rate = np.array([t.angle_rad / t.seconds for t in own])
    raw = np.array([t.rates_radps[axis] for t in own])
    fit = LineFit(
        channel=channel,
        zero=zero,
        slope=1.0 / followed,
        zero_sigma=zero_sigma,
        slope_sigma=sigma95((share, worth + free), (table.scale**2, math.inf)),
        residual=float(np.sqrt(np.mean((raw - zero - followed * rate) ** 2))),
        hysteresis=0.0,
        bend=math.nan,
        repeat_zeros=zeros,
        repeat_zero_sigma=math.hypot(rest.placing, rest.reading) * RAD_PER_DEG,
        value=np.r_[np.zeros(len(still)), rate],
        raw=np.r_[still, raw],
        residuals=np.r_[still - zero, raw - zero - followed * rate],
        repeat=np.r_[repeats, [t.repeat for t in own]],
        direction=np.zeros(len(still) + len(own), dtype=np.int64),
        scatter=float(np.std(still)),
        position=np.r_[np.zeros(len(still)), rate * DEG_PER_RAD],
        fitted=np.r_[np.full(len(still), zero), zero + followed * rate],
    )
    return Calibrated(channel, fit, _limits(subject, fit), _short(subject, numbers, angle))


def _zeros(rests: Sequence[Rest]) -> Array:
    return np.asarray(np.mean([r.rates_radps for r in rests], axis=0))


def _zero_sigma(rest: Tool, still: Array, repeats: int) -> float:
    worth, free = hand_worth(), len(still) - 1
    word = (rest.reading * RAD_PER_DEG) ** 2
    seen = float(np.var(still, ddof=1)) * free if free else 0.0
    variance = (worth * word + seen) / (worth + free)
    return sigma95(
        (variance / len(still), worth + free),
        ((rest.placing * RAD_PER_DEG) ** 2 / repeats, worth),
        ((rest.own * RAD_PER_DEG) ** 2, math.inf),
    )


def _other_axis(seen: Array, angle: Array, axis: int) -> tuple[int, float]:
    """Return the other axis that turned most, and its share of the angle."""
    shares = [float(seen[:, k] @ angle / (angle @ angle)) for k in range(3)]
    rest = [k for k in range(3) if k != axis]
    most = max(rest, key=lambda k: abs(shares[k]))
    return most, shares[most]


def _axis_doubt(channel: str, followed: float, other: tuple[int, float]) -> str:
    name, share = RATES[other[0]], other[1]
    if followed < _OPPOSITE:
        return f"gyro {channel} turns the wrong way: the IMU is mounted turned round, or the turn"
    if abs(share) > _RESPONSE_SHARE:
        return (
            f"gyros {channel} and {name} are swapped: the turn about {channel}'s axis was seen by"
            f" {name}; look at how the IMU is mounted"
        )
    return f"gyro {channel} does not follow: it saw {100.0 * followed:.0f} % of the angle"


def _limits(subject: Subject, fit: LineFit) -> str | None:
    least, most = subject.limits["slope"]
    if not least <= fit.slope <= most:
        return (
            f"gyro {fit.channel} has a slope of {fit.slope:.4f}, expected {least:g} to {most:g}:"
            " count the turns again; full scale of the chip?"
        )
    if abs(fit.zero) > subject.limits["zero"][1] + 6.0 * fit.zero_sigma:
        return (
            f"gyro {fit.channel} reads {fit.zero * DEG_PER_RAD:.2f} deg/s at rest, limit"
            f" {subject.limits['zero'][1] * DEG_PER_RAD:.1f}: warm up, `imu zero`, and again"
        )
    return None


def _short(subject: Subject, numbers: Array, angle: Array) -> str:
    lacking = []
    if len(numbers) < subject.repeats:
        lacking.append(f"{len(numbers)} repeat of {subject.repeats}")
    if not (angle.min() < 0.0 < angle.max()):
        lacking.append("one direction only: turn it back as well")
    return "; ".join(lacking)
