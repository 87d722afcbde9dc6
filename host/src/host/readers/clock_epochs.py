"""Clocks within one log: where one starts again, where one was set, and from when it counts.

A log holds as many epochs as its autopilot's clock has starts: boots on the bench and flights of a
station that recorded on. Within an epoch the clock runs, and what steps back is damage
(`plausible_times`).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array, IntArray

BACK_S = 1.0  # records of one clock are in order to a fraction of this
FEWEST = 3  # records on each side: a single one may be a changed bit
SET_S = 0.5  # a station's clock that jumps by more was set; a radio is late by less
SIDE = 25  # messages on each side of it: a burst behind an outage is shorter
LONGEST_SINCE_BOOT_S = 30 * 86400.0  # a clock that says more counts since 1970


def epoch_starts(clocks: Iterable[tuple[NDArray[np.integer], Array]]) -> list[int]:
    """Return the places in a log at which the clock starts again, first place excluded.

    Parameters
    ----------
    clocks : iterable of (places, times)
        Where each record of a kind stands in the log, ascending, and its time, s; a pair per kind.
    """
    spans: list[tuple[int, int]] = []
    for places, t_s in clocks:
        for row in np.flatnonzero(np.diff(t_s) < -BACK_S).tolist():
            before, after = t_s[max(row + 1 - FEWEST, 0) : row + 1], t_s[row + 1 :][:FEWEST]
            if min(len(before), len(after)) < FEWEST:
                continue
            if np.median(after) < np.median(before) - BACK_S:
                spans.append((int(places[row]), int(places[row + 1])))
    found: list[int] = []
    end = -1
    for last, first in sorted(spans):
        if found and last < end:  # the same start, seen by another kind
            found[-1], end = max(found[-1], last + 1), min(end, first)
        else:
            found.append(last + 1)
            end = first
    return found


def clock_sets(offset_s: Array) -> IntArray:
    """Return the rows before which a clock was set, by its offset (n,) from one that was not."""
    found = []
    for row in np.flatnonzero(np.abs(np.diff(offset_s)) > SET_S).tolist():
        before, after = offset_s[max(row + 1 - SIDE, 0) : row + 1], offset_s[row + 1 :][:SIDE]
        moved = abs(float(np.median(after) - np.median(before)))
        if min(len(before), len(after)) == SIDE and moved > SET_S:
            found.append(row + 1)
    return np.array(found, dtype=np.int64)


def clock_origin_s(clocks: Iterable[Array]) -> float:
    """Return the instant from which times are counted: 0 of a clock since boot, else its first.

    The clocks of one log agree: a time since 1970 in one record alone is a changed bit.
    """
    firsts = [float(np.median(t_s[:5])) for t_s in clocks if len(t_s)]
    if not firsts or np.median(firsts) <= LONGEST_SINCE_BOOT_S:
        return 0.0
    return float(min(t for t in firsts if t > LONGEST_SINCE_BOOT_S))
