"""The fault of a channel, in one sentence: the first cause that explains its points.

A fault must exceed a limit of `bench.toml` and six standard deviations of hand and tool, so that
chance accuses none of the 19 lines of a healthy instrument.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.held_position import Held
from host.bench_calibration.line_fit import LineFit

Array = NDArray[np.float64]
BEYOND = 6.0  # standard deviations
_STILL = 0.2  # share of the expected range below which a channel does not follow
_RESPONSE_SHARE = 0.5
_LONG_HOLD_S = 20.0
_LEAST_POSITIONS = 5
_MAD_TO_SIGMA = 1.4826
UNITS = {"channel": "counts", "pulse": "us", "imu": ""}


def doubt_before_fit(subject: Subject, channel: str, points: Sequence[Held]) -> str | None:
    """Return why no line should be drawn: another channel moved, or none."""
    expected = np.ptp([p.position for p in points]) / subject.limits["slope"][1]
    span = _span(points, channel)
    if not expected or span >= _STILL * expected:
        return None
    others = {c: _span(points, c) for c in subject.channels if c != channel}
    moved = max(others, key=lambda c: others[c], default="")
    unit = UNITS[subject.table]
    if moved and others[moved] >= _RESPONSE_SHARE * expected:
        return (
            f"{channel} and {moved} are swapped: {channel} was moved, {moved} went through"
            f" {others[moved]:.0f} {unit} and {channel} through {span:.0f}; change their plugs"
        )
    return (
        f"{channel} does not follow: {span:.1f} {unit} where {expected:.0f} are expected; look at"
        " its plug, supply and shaft"
    )


def doubt(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    """Return the first cause that explains what is wrong with a line, None if nothing is."""
    tests: tuple[Callable[[Subject, LineFit, Sequence[Held]], str | None], ...] = (
        _reversed,
        _noisy,
        _slipped,
        _spot,
        _leaking,
        _loose,
        _scattered,
        _slope,
        _zero,
    )
    return next((text for test in tests if (text := test(subject, fit, points))), None)


def _span(points: Sequence[Held], channel: str) -> float:
    known = [p.readings[channel] for p in points if channel in p.readings]
    return float(np.ptp(known)) if known else 0.0


def _reversed(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    if not subject.signed or fit.slope > 0.0:
        return None
    why = "total and static hoses are swapped" if subject.name == "pitots" else "its sign is wrong"
    return f"{fit.channel} falls where it should rise: {why}"


def _noisy(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    known = [(p.noise[fit.channel], p.position) for p in points if fit.channel in p.noise]
    if not known:
        return None
    limit = max(subject.limits["noise"], 4.0 * float(np.median([n for n, _ in known])))
    loud = [(n, at) for n, at in known if n > limit]
    if not loud:
        return None
    noise, at = max(loud)
    places = len({position for _, position in loud})
    named = f"{fit.channel} is worn" if subject.name == "pots" else f"{fit.channel} is not quiet"
    return (
        f"{named} at {at:g} {_setting(subject)}: {noise:.1f} {UNITS[subject.table]} rms while held"
        f" still, limit {limit:.1f} ({places} position{'s' if places > 1 else ''});"
        " look at track, plug and supply"
    )


def _slipped(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    limit = max(subject.limits["slip"], BEYOND * math.sqrt(2.0) * fit.repeat_zero_sigma)
    apart = float(np.ptp(fit.repeat_zeros))
    within, repeat = _return_error(fit, subject)
    if max(apart, within) <= limit:
        return None
    unit = UNITS[subject.table]
    if within > apart:
        where = f"within repeat {repeat} by {within:.1f} {unit}"
    else:
        zeros = ", ".join(f"{z:.4g}" for z in fit.repeat_zeros)
        where = f"between repeats by {apart:.1f} {unit} (zeros {zeros})"
    return (
        f"{fit.channel} slipped: its zero moved {where}, limit {limit:.1f}; fasten it on its shaft"
    )


def _return_error(fit: LineFit, subject: Subject) -> tuple[float, int]:
    """Return how far the last reading of a repeat is from the first at the same position."""
    worst, number = 0.0, 0
    if subject.table == "imu":
        return worst, number
    for repeat in np.unique(fit.repeat):
        inside = np.flatnonzero(fit.repeat == repeat)
        first, last = inside[0], inside[-1]
        if first == last or fit.position[first] != fit.position[last]:
            continue
        error = abs(float(fit.raw[last] - fit.raw[first])) - fit.hysteresis
        if error > worst:
            worst, number = error, int(repeat)
    # Two single readings, not two means of a repeat.
    return worst - BEYOND * math.sqrt(2.0) * fit.scatter, number


def _spot(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    places = np.unique(fit.position)
    if len(places) < _LEAST_POSITIONS:
        return None
    best: tuple[float, float, float] | None = None
    for place in places:
        here = fit.position == place
        rest = ~here
        residual = fit.straightened - _line_through(fit.value, fit.straightened, rest)
        # In the mean over all repeats their placings cancel.
        middle = float(np.median(residual[rest]))
        scatter = _MAD_TO_SIGMA * float(np.median(np.abs(residual[rest] - middle)))
        distance = abs(float(residual[here].mean()) - middle)
        limit = max(subject.limits["spot"], BEYOND * max(scatter, fit.repeat_zero_sigma)
                    / math.sqrt(here.sum()))  # fmt: skip
        if distance > limit and (best is None or distance / limit > best[0] / best[1]):
            best = (distance, limit, float(place))
    if best is None:
        return None
    distance, limit, place = best
    what = "is worn: a dead spot" if subject.name == "pots" else "leaves its line"
    return (
        f"{fit.channel} {what} at {place:g} {_setting(subject)}: {distance:.1f}"
        f" {UNITS[subject.table]} off the line of the others in every pass, limit {limit:.1f}"
    )


def _line_through(value: Array, raw: Array, used: NDArray[np.bool_]) -> Array:
    """Return the line through some of the points, at all of them."""
    x, y = value[used], raw[used]
    about = x - x.mean()
    gradient = float(about @ y) / float(about @ about)
    return np.asarray(y.mean() + gradient * (value - x.mean()))


def _leaking(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    if "leak" not in subject.limits:
        return None
    rates = [
        -p.change[fit.channel] / (p.readings[fit.channel] - fit.zero)
        for p in points
        if fit.channel in p.change
        and p.duration_s >= _LONG_HOLD_S
        and abs(p.position) >= 0.5 * float(np.abs(fit.position).max())
    ]
    if not rates or float(np.median(rates)) <= subject.limits["leak"]:
        return None
    percent = 100.0 * 60.0 * float(np.median(rates))
    allowed = 100.0 * 60.0 * float(subject.limits["leak"])
    return (
        f"{fit.channel} has a leaking tube: a held pressure falls by {percent:.1f} % a minute,"
        f" limit {allowed:.1f} %; look at hose, T and fittings"
    )


def _loose(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    if fit.hysteresis <= subject.limits["hysteresis"]:
        return None
    return (
        f"{fit.channel} has play: {fit.hysteresis:.1f} {UNITS[subject.table]} between up and down,"
        f" limit {subject.limits['hysteresis']:g}; look at bearing, gear and linkage"
    )


def _scattered(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    if fit.residual <= subject.limits["residual"]:
        return None
    bent = fit.bend > fit.residual
    why = "bent: the tool's pivot, or a magnet off its centre" if bent else "readings scatter"
    return (
        f"{fit.channel} is no line: residual {fit.residual:.2f} {UNITS[subject.table]}, limit"
        f" {subject.limits['residual']:g} ({why})"
    )


def _slope(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    tool = subject.tool
    if tool is None or tool.setting == "m/s":
        return None
    slope = abs(fit.slope) / tool.value(1.0)
    least, most = subject.limits["slope"]
    room = BEYOND * fit.slope_sigma * slope
    if least - room <= slope <= most + room:
        return None
    return (
        f"{fit.channel} has a slope of {slope:.4g} {tool.setting} per count, expected {least:g} to"
        f" {most:g}; is it the part of the list, and the tool's unit {tool.setting}?"
    )


def _zero(subject: Subject, fit: LineFit, points: Sequence[Held]) -> str | None:
    least, most = subject.limits["zero"]
    room = BEYOND * fit.zero_sigma
    if least - room <= fit.zero <= most + room:
        return None
    return (
        f"{fit.channel} has its zero at {fit.zero:.4g} {UNITS[subject.table]}, expected {least:g}"
        f" to {most:g}; turn it on its shaft, or the sensor is out of its data sheet"
    )


def _setting(subject: Subject) -> str:
    return subject.tool.setting if subject.tool is not None else ""
