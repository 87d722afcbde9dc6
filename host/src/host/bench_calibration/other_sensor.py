"""A sensor of another slope than the part of the list, asked about before it is judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.held_position import Held

_IN_COUNTS = ("bend", "residual", "hysteresis", "spot", "slip")
_ALL_COUNTS = [0.0, 1023.0]


def judged_subject(subject: Subject, held: Sequence[Held], ask: Callable[[str], str]) -> Subject:
    """Return the subject with the limits of the sensor that was moved.

    Where slopes are those of no part of the list and still of such a sensor (`other_slope` in
    `bench.toml`), whoever is at the bench is asked; what was allowed in degrees is allowed then.

    Parameters
    ----------
    subject : Subject
    held : sequence of Held
    ask : callable
        Takes a question, returns the typed line.
    """
    limits, tool = subject.limits, subject.tool
    if "other_slope" not in limits or tool is None:
        return subject
    least, most = limits["other_slope"]
    ours = limits["slope"]
    slopes = {c: abs(_slope(held, c)) for c in subject.channels}
    # Beyond what is said of a part that is 10 % out of its data sheet.
    other = [
        s for s in slopes.values()
        if least <= s <= most and not 0.9 * ours[0] <= s <= 1.1 * ours[1]
    ]  # fmt: skip
    if not other:
        return subject
    usual = float(np.mean(ours))
    question = (
        f"{other[0]:.3g} {tool.setting} a count, where the part of the list has {usual:.3g}."
        " Is it another sensor, such as a potentiometer? [y/N] "
    )
    if not ask(question).strip().lower().startswith("y"):
        return subject
    wider = max(usual / min(other), 1.0)
    own = {name: wider * limits[name] for name in _IN_COUNTS if name in limits}
    return replace(subject, limits={**limits, **own, "slope": [least, most], "zero": _ALL_COUNTS})


def _slope(held: Sequence[Held], channel: str) -> float:
    """Return degrees a count by least squares; 0 of a channel that was not moved or stood still."""
    points = [p for p in held if p.moved == channel and channel in p.readings]
    readings = np.array([p.readings[channel] for p in points])
    if len(points) < 2 or not np.ptp(readings) > 0.0:
        return 0.0
    return float(np.polyfit(readings, [p.position for p in points], 1)[0])
