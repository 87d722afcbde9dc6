"""One held position and the readings of every channel there; every source returns these."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Held:
    """Readings while a position was held.

    Attributes
    ----------
    moved : str
        The channel that was set.
    repeat : int
        From 1 on; the tool was put on anew for each.
    position : float
        In the unit of the tool's setting.
    readings : mapping of str to float
        Mean of each channel that was read, in the raw unit of protocol/frames.toml.
    noise : mapping of str to float
        rms while held; empty where nobody knows.
    change : mapping of str to float
        Raw units per second while held; empty where nobody knows.
    duration_s : float
    """

    moved: str
    repeat: int
    position: float
    readings: Mapping[str, float]
    noise: Mapping[str, float] = field(default_factory=dict)
    change: Mapping[str, float] = field(default_factory=dict)
    duration_s: float = math.nan


class Source(Protocol):
    """Where held positions come from: a table, a keyboard, a log, the logger over USB."""

    def held(self) -> list[Held]:
        """Return all held positions in the order in which they were set."""


def directions(points: Sequence[Held]) -> list[int]:
    """Return for each position of one channel whether it was reached from below (1), from above
    (-1), or nobody knows (0): the first of a repeat."""
    found = []
    for last, point in zip([None, *points[:-1]], points, strict=True):
        if last is None or last.repeat != point.repeat or last.position == point.position:
            found.append(0)
        else:
            found.append(1 if point.position > last.position else -1)
    return found
