"""How long a maneuver goes on: from the rest before its input to the next thing that moves it.

What follows an input with the surfaces at rest is the aircraft's own motion. The phugoid is in
nothing else: cut off three seconds after the input, D_V of a linear record is known 30 times worse
than it can be.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.sysid.maneuvers.overlapping_inputs import SUSTAINED, flown_together, rad_of
from host.sysid.numerics.white_noise import white_deviation

if TYPE_CHECKING:
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver

MOVED_RAD = 0.0035  # by as much a surface leaves its rest: 0.2 deg, or
MOVED_SHARE = 0.05  # of the input, or
MOVED_NOISE = 5.0  # deviations of its noise; a pilot who holds the attitude moves it more
REST_S = 0.5  # after the input, in which surfaces come to rest
ENDS_S = 2.0
LONGEST_S = 120.0
SHORTEST_LEAD_S = 1.9  # less is chance: the pilot of the twin holds still for up to 1.7 s
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
        name: max(MOVED_RAD / rad_of(name), MOVED_NOISE * float(white_deviation([series])))
        for name, series in surfaces.items()
    }
    groups = flown_together(found)
    starts_s = [*(group[0].start_s for group in groups), np.inf][1:]
    before_s = taken_s = -np.inf
    result: list[DetectedManeuver] = []
    for group, next_s in zip(groups, starts_s, strict=True):
        amplitude = max(item.amplitude for item in group)
        limits = {name: max(x, MOVED_SHARE * amplitude) for name, x in still.items()}
        at_rest = _AtRest(surfaces, limits, usable)
        limit_s = max(before_s + REST_S, taken_s)
        result += _of_group(group, t, at_rest, limit_s, next_s)
        before_s = max(before_s, *(item.input_end_s for item in group))
        taken_s = max(item.fit_window()[1] for item in result)
    return sorted(result, key=lambda item: item.start_s)


def _of_group(
    group: Sequence[DetectedManeuver], t: Array, at_rest: _AtRest, from_s: float, next_s: float
) -> list[DetectedManeuver]:
    """Return inputs that overlap, each with the rest before the first and the response to all."""
    first, last = group[0], max(group, key=lambda item: item.input_end_s)
    # The slow swings at the ends of an input without edges are its own.
    own_s = [ENDS_S if item.kind in SUSTAINED else 0.0 for item in (first, last)]
    free_end_s = _until(t, at_rest, last.input_end_s + own_s[1], next_s - last.lead_s)
    begin_s = max(_since(t, at_rest, first.start_s - own_s[0], from_s), float(t[0]))
    lead_s = min(first.lead_s, first.start_s - float(t[0]))
    if first.start_s - begin_s > SHORTEST_LEAD_S:
        lead_s = first.start_s - begin_s
    free_end_s = max(free_end_s, *(item.end_s for item in group)) if len(group) > 1 else free_end_s
    return [
        replace(item, lead_s=lead_s + item.start_s - first.start_s, free_end_s=free_end_s)
        for item in group
    ]


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
    """Return until when nothing moves after an input, once the surfaces have come to rest."""
    first = np.searchsorted(t, from_s)
    last, settled = np.searchsorted(t, (min(limit_s, from_s + LONGEST_S), from_s + REST_S), "right")
    if last <= first:
        return -np.inf
    settling = np.arange(first, settled)
    whole = at_rest.usable[settling].all()
    span = np.arange(min(settled, last - 1) if whole else first, last)
    return float(t[span[at_rest.samples(span, settling) - 1]])


def _since(t: Array, at_rest: _AtRest, to_s: float, limit_s: float) -> float:
    """Return since when nothing moved before an input, its first departure aside."""
    first, last = np.searchsorted(t, (max(limit_s, to_s - LONGEST_LEAD_S), to_s), "right")
    settled = np.arange(*np.searchsorted(t, (to_s - REST_S, to_s)))
    if last <= first or len(settled) == 0 or not at_rest.usable[settled].all():
        return to_s
    span = np.arange(first, max(settled[0], first) + 1)[::-1]
    return float(t[span[at_rest.samples(span, settled) - 1]])
