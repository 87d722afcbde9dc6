"""The clock of a table: counters that begin again, digits too few for the rate, several recordings.

A counter of 16 or 32 bits, a time of day and a time of the week begin again while the recording
goes on: all rows lie within one of its periods, and each step back is that period less a step. Any
other step back is another recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.readers.airborne import FLYING_MPS
from host.readers.clock_epochs import epoch_starts

PERIODS_S = {
    "16 bits of microseconds": 2.0**16 * 1e-6, "16 bits of milliseconds": 2.0**16 * 1e-3,
    "32 bits of microseconds": 2.0**32 * 1e-6, "32 bits of milliseconds": 2.0**32 * 1e-3,
    "a day": 86400.0, "a week": 604800.0,
}  # fmt: skip
LONGEST_STEP_S = 1.0  # from the last row of a period to the first of the next
REPEATED = 0.2  # of the rows: more stand on an instant of others because its digits are too few
EVEN = 0.75  # of a digit: even rows lie as near to a line, with half a digit of rounding


def counted_on(t_s: Array, notes: list[str]) -> Array:
    """Return times (n,) that go on where a counter, a day or a week began again, and a note."""
    seen = np.flatnonzero(np.isfinite(t_s))
    steps = np.diff(t_s[seen])
    if not len(steps) or steps.min() >= 0.0:
        return t_s
    span_s = float(np.ptp(t_s[seen]))
    for called, period_s in PERIODS_S.items():
        back = steps < -0.5 * period_s
        most_s = min(LONGEST_STEP_S, 0.5 * period_s)
        if span_s > period_s or not back.any() or (steps[back] + period_s > most_s).any():
            continue
        on = np.array(t_s)
        on[seen[1:]] += period_s * np.cumsum(back)
        many = int(back.sum())
        again = "once" if many == 1 else f"{many} times"
        notes.append(
            f"t_s begins again {again}, after {called} (row {seen[np.argmax(back) + 1] + 1}):"
            " counted on"
        )
        return on
    return t_s


def evenly_timed(columns: Mapping[str, Array]) -> tuple[Array, float] | None:
    """Return even times (n,) of rows whose time has too few digits, and its digit, s.

    None where each row has its own instant, where rows repeat each other in all columns, or where
    no even rate explains the times: then nothing says when a row was measured.
    """
    t = columns["t_s"]
    steps = np.diff(t)
    if len(t) < 3 or not np.isfinite(t).all() or (steps < 0.0).any():
        return None
    still = steps == 0.0
    if np.mean(still) < REPEATED or still.all():
        return None
    others = [values for name, values in columns.items() if name != "t_s"]
    same = np.all([(np.diff(v) == 0.0) | ~np.isfinite(np.diff(v)) for v in others], axis=0)
    if np.mean(same[still]) > 0.5:
        return None
    digit_s = float(np.median(steps[~still]))
    rows = np.arange(len(t), dtype=np.float64)
    line = np.polynomial.Polynomial.fit(rows, t, 1)(rows)
    return (line, digit_s) if np.max(np.abs(t - line)) < EVEN * digit_s else None


def recordings(t_s: Array) -> list[IntArray]:
    """Return the rows of each recording of a table, by its times (n,), which go on within one."""
    seen = np.flatnonzero(np.isfinite(t_s))
    places: IntArray = np.arange(len(seen))
    ends = [0, *epoch_starts([(places, t_s[seen])]), len(seen)]
    return [seen[a:b] for a, b in pairwise(ends)]


def one_recording(
    columns: Mapping[str, Array], flight: int | None, source: str, notes: list[str]
) -> dict[str, Array]:
    """Return the rows of one recording of a table: the one asked for, else the longest in flight.

    Raises
    ------
    IdentificationError
        If there is none of that number.
    """
    t = columns["t_s"]
    parts = recordings(t)
    if flight is not None and not 1 <= flight <= len(parts):
        raise IdentificationError(f"{source}: no flight {flight}; it has 1 to {len(parts)}")
    if len(parts) == 1:
        return dict(columns)
    lengths = [flown_s(columns, rows) for rows in parts]
    chosen = int(np.argmax(lengths)) if flight is None else flight - 1
    listed = ", ".join(
        f"{k}: rows {rows[0] + 1} to {rows[-1] + 1}, {np.ptp(t[rows]):.0f} s"
        for k, rows in enumerate(parts, start=1)
    )
    notes.append(
        f"t_s begins again {len(parts) - 1} times: {len(parts)} flights ({listed}); {chosen + 1} is"
        " used, --flight takes another"
    )
    rows = parts[chosen]
    return {name: values[rows] for name, values in columns.items()}


def flown_s(columns: Mapping[str, Array], rows: IntArray) -> float:
    """Return how long a recording flew; how long it is, if it does not say."""
    length_s = float(np.ptp(columns["t_s"][rows]))
    speed = columns.get("airspeed_mps")
    return length_s if speed is None else length_s * float(np.mean(speed[rows] > FLYING_MPS))
