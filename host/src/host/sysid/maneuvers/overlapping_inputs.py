"""Inputs that overlap in time: which is but an echo of another, and which are flown together.

A surface that moves with another may be an input of its own, however small: 1.5 degrees of the
elevator with 5 of the rudder show all of the longitudinal motion. What tells an echo is where its
motion comes from: it follows the attitude (a pilot who takes over), or it swings faintly without an
edge (handling, noise).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array

if TYPE_CHECKING:
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver

FAINT = 0.2  # of an input: a weaker one of another surface is the pilot's, and ends no response
WEAKER = 0.6  # of an input that it overlaps: a stronger one is no echo, nor a pilot's handling
FULL_RAD = 0.2  # the surface that full throttle counts as
# Which way a hand that levels moves a surface, from the jump on with which it takes over.
LEVELLING = {"elevator_rad": ("theta_rad", 1.0), "aileron_rad": ("phi_rad", -1.0)}
FOLLOWS_S, FOLLOWED = (0.1, 1.5), 0.75
SUSTAINED = {"multisine", "sweep"}


def without_echoes(
    found: Sequence[DetectedManeuver], columns: Mapping[str, Array]
) -> list[DetectedManeuver]:
    """Return the inputs that are no echo of another.

    Parameters
    ----------
    found : sequence of DetectedManeuver
    columns : mapping of (n,) Array
        `t_s`, the surfaces, and what a pilot follows if it is there.
    """
    return [item for item in found if not any(_echo(item, other, columns) for other in found)]


def bounded(found: Sequence[DetectedManeuver], last_s: float) -> list[DetectedManeuver]:
    """End each window where an input begins that is not flown together with it."""
    result = []
    for item in found:
        starts = (f.start_s for f in found if f.start_s >= item.input_end_s and not _faint(f, item))
        limit_s = min(starts, default=last_s)
        result.append(replace(item, end_s=min(item.end_s, limit_s, last_s)))
    return result


def flown_together(found: Sequence[DetectedManeuver]) -> list[list[DetectedManeuver]]:
    """Return inputs in groups whose members overlap in time, one by one or through others.

    Parameters
    ----------
    found : sequence of DetectedManeuver
        In order of time.
    """
    groups: list[list[DetectedManeuver]] = []
    for item in found:
        if groups and item.start_s < max(f.input_end_s for f in groups[-1]):
            groups[-1].append(item)
        else:
            groups.append([item])
    return groups


def _echo(item: DetectedManeuver, other: DetectedManeuver, columns: Mapping[str, Array]) -> bool:
    overlap = item.start_s < other.input_end_s and other.start_s < item.input_end_s
    if not overlap or not _weaker(item, other, WEAKER):
        return False
    faint = item.swings and _faint(item, other)
    return faint or _follows_attitude(item, columns)


def _follows_attitude(item: DetectedManeuver, columns: Mapping[str, Array]) -> bool:
    """Return whether a surface is moved as a hand that levels moves it.

    The independent simulator's pilot has 0.81 to 0.995 of the elevator explained so in gusts of 1
    m/s, doublets, pulses and 3-2-1-1s 0.5 at most.
    """
    if item.axis not in LEVELLING or LEVELLING[item.axis][0] not in columns:
        return False
    name, sign = LEVELLING[item.axis]
    t = columns["t_s"]
    last_s = max(item.input_end_s, item.start_s + FOLLOWS_S[1])
    rows = np.flatnonzero((t >= item.start_s + FOLLOWS_S[0]) & (t <= last_s))
    if not len(rows):
        return False
    attitude, surface = (columns[n][rows] - np.mean(columns[n][rows]) for n in (name, item.axis))
    both = float(attitude @ surface)
    explained = both**2 > FOLLOWED * float(attitude @ attitude) * float(surface @ surface)
    return sign * both > 0.0 and explained


def _faint(other: DetectedManeuver, item: DetectedManeuver) -> bool:
    """Return whether another surface moves too little to matter in the response to an input."""
    return _weaker(other, item, FAINT)


def _weaker(item: DetectedManeuver, other: DetectedManeuver, share: float) -> bool:
    return item.axis != other.axis and _strength(item) < share * _strength(other)


def _strength(item: DetectedManeuver) -> float:
    """Return the amplitude, that of a throttle as one of a surface."""
    return item.amplitude * rad_of(item.axis)


def rad_of(axis: str) -> float:
    """Return which angle of a surface one unit of an axis counts as."""
    return FULL_RAD if axis == "throttle" else 1.0
