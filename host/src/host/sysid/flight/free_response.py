"""How long a maneuver goes on: from the rest before its input to the next thing that moves it.

What follows an input with the surfaces at rest is the aircraft's own motion. The phugoid is in
nothing else: cut off three seconds after the input, D_V of a linear record was known 30 times worse
than it could be.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array, BoolArray, IntArray

if TYPE_CHECKING:
    from host.sysid.flight.maneuver_detection import DetectedManeuver

MOVED_RAD, MOVED_THROTTLE = 0.0035, 0.02  # by as much a surface leaves its rest: 0.2 deg, or
MOVED_SHARE = 0.05  # of the input, or
MOVED_NOISE = 5.0  # deviations of its noise; a pilot who holds the attitude moves it more
REST_S = 0.5  # after the input, in which surfaces come to rest
ENDS_S = 2.0
LONGEST_S = 120.0
SHORTEST_LEAD_S = 1.9  # a moment of rest is chance: a pilot holds still for as long
LONGEST_LEAD_S = 30.0  # of rest before the input, which tells of the constants


def with_free_response(
    found: Sequence[DetectedManeuver],
    t: Array,
    surfaces: Mapping[str, Array],
    usable: BoolArray,
) -> list[DetectedManeuver]:
    """Return maneuvers in order of time, each with the rest before and the response after it.

    Parameters
    ----------
    found : sequence of DetectedManeuver
        In order of time.
    t : Array, shape (n,)
    surfaces : mapping of (n,) Array
        Everything that a pilot moves.
    usable : Array, shape (n,)
        In flight, and measured.
    """
    still = {
        name: max(MOVED_THROTTLE if name == "throttle" else MOVED_RAD, MOVED_NOISE * _noise(series))
        for name, series in surfaces.items()
    }
    result: list[DetectedManeuver] = []
    for k, item in enumerate(found):
        end_s = min((f.start_s for f in found[k + 1 :]), default=np.inf)
        limits = {name: max(x, MOVED_SHARE * item.amplitude) for name, x in still.items()}
        at_rest = _AtRest(surfaces, limits, usable)
        # The slow swings at the ends of an input without edges are its own.
        own_s = ENDS_S if item.kind in ("multisine", "sweep") else 0.0
        free_end_s = _until(t, at_rest, item.input_end_s + own_s, end_s - item.lead_s)
        begin_s = max((f.input_end_s for f in found[:k]), default=-np.inf)
        taken_s = max((f.fit_window()[1] for f in result), default=-np.inf)
        first_s = _since(t, at_rest, item.start_s - own_s, max(begin_s + REST_S, taken_s))
        first_s = max(first_s, float(t[0]))
        lead_s = min(item.lead_s, item.start_s - float(t[0]))
        if item.start_s - first_s > SHORTEST_LEAD_S:
            lead_s = item.start_s - first_s
        result.append(replace(item, lead_s=lead_s, free_end_s=free_end_s))
    return result


@dataclass(frozen=True, slots=True)
class _AtRest:
    surfaces: Mapping[str, Array]
    limits: Mapping[str, float]
    usable: BoolArray

    def samples(self, span: IntArray, rest: IntArray) -> int:
        """Return how many of a span, in its order, go by before a surface leaves its rest."""
        still = self.usable[span].copy()
        for name, series in self.surfaces.items():
            still &= np.abs(series[span] - np.median(series[rest])) < self.limits[name]
        moving = np.flatnonzero(~still)
        return max(int(moving[0]), 1) if len(moving) else len(span)


def _until(t: Array, at_rest: _AtRest, from_s: float, limit_s: float) -> float:
    """Return until when nothing moves after an input."""
    first = np.searchsorted(t, from_s)
    last, settled = np.searchsorted(t, (min(limit_s, from_s + LONGEST_S), from_s + REST_S), "right")
    span, settling = np.arange(first, last), np.arange(first, settled)
    return float(t[span[at_rest.samples(span, settling) - 1]]) if len(span) else -np.inf


def _since(t: Array, at_rest: _AtRest, to_s: float, limit_s: float) -> float:
    """Return since when nothing moved before an input."""
    first, last = np.searchsorted(t, (max(limit_s, to_s - LONGEST_LEAD_S), to_s), "right")
    span = np.arange(first, last)[::-1]
    settled = np.arange(*np.searchsorted(t, (to_s - REST_S, to_s)))
    if len(span) == 0 or len(settled) == 0:
        return to_s
    return float(t[span[at_rest.samples(span[1:], settled)]]) if len(span) > 1 else to_s


def _noise(series: Array) -> float:
    """Return the deviation of white noise, from second differences: motion has hardly any."""
    second = np.abs(np.diff(series, n=2))
    return float(np.median(second)) / (0.6745 * np.sqrt(6.0)) if len(second) else 0.0
