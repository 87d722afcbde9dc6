"""Held positions in a record: stretches in which nothing moves, found by themselves."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.errors import UsageError

Array = NDArray[np.float64]

BLOCK_S = 0.1  # its median passes over a single jump
LOOKED_S = 0.3  # a channel that is as far as before this much ago stands still
LEAST_S = 1.0  # the procedures hold for 2 s
GAP_S = 0.5  # rows lost for this long break no position that goes on behind them
EDGE_S = 0.2  # at both ends somebody still settles
_BEYOND = 6.0  # standard deviations of a block's median
_MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True, slots=True)
class Plateau:
    """A stretch in which nothing moved: rows [first, last), and its times, s."""

    first: int
    last: int
    begin_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        """How long it lasts, edges included."""
        return self.end_s - self.begin_s + 2.0 * EDGE_S


def plateaus(t_s: Array, raw: Array, least: Sequence[float]) -> list[Plateau]:
    """Return the stretches in which every channel stands still.

    Parameters
    ----------
    t_s : (rows,) array
        Rising.
    raw : (rows, channels) array
        NaN where there is no value.
    least : sequence of float
        Per channel: less than this in 0.3 s is no motion, whatever the noise.
    """
    number = np.floor((t_s - t_s[0]) / BLOCK_S).astype(int) if len(t_s) else np.empty(0, int)
    edges = np.searchsorted(number, np.arange(number[-1] + 2)) if len(t_s) else np.empty(0, int)
    if len(edges) < 5:
        return []
    still = np.ones(len(edges) - 1, dtype=bool)
    middles = np.full((len(edges) - 1, raw.shape[1]), np.nan)
    known_at = -1
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        part = raw[a:b]
        if b > a and np.isfinite(part).any(axis=0).all():
            middles[k] = np.nanmedian(part, axis=0)
            known_at = k
        elif 0 <= known_at >= k - round(GAP_S / BLOCK_S):
            middles[k] = middles[k - 1]
    steps = max(round(LOOKED_S / BLOCK_S), 1)
    for channel, floor in enumerate(least):
        x = middles[:, channel]
        known = np.diff(x)[np.isfinite(np.diff(x))]
        noise = _MAD_TO_SIGMA * float(np.median(np.abs(known))) if len(known) else 0.0
        moving = np.abs(x[steps:] - x[:-steps]) > max(floor, _BEYOND * noise)
        still &= np.isfinite(x)
        for back in range(steps + 1):
            still[back : len(still) - steps + back] &= ~moving
    return _joined(t_s, edges, still)


def _joined(t_s: Array, edges: NDArray[np.int64], still: NDArray[np.bool_]) -> list[Plateau]:
    change = np.flatnonzero(np.diff(np.r_[0, still.astype(int), 0]))
    found = []
    for begin, end in zip(change[::2], change[1::2], strict=True):
        a, b = int(edges[begin]), int(edges[end])
        first = int(np.searchsorted(t_s, t_s[a] + EDGE_S))
        last = int(np.searchsorted(t_s, t_s[b - 1] - EDGE_S))
        if last - first > 2 and t_s[b - 1] - t_s[a] >= LEAST_S - BLOCK_S:
            found.append(Plateau(first, last, float(t_s[first]), float(t_s[last - 1])))
    return found


def before_marks(t_s: Array, marks_s: Sequence[float], seconds: float = 2.0) -> list[Plateau]:
    """Return the stretch before each mark of the button."""
    found = []
    for mark in marks_s:
        first, last = (int(np.searchsorted(t_s, mark - s)) for s in (seconds, 0.0))
        if last > first:
            found.append(Plateau(first, last, float(t_s[first]), float(t_s[last - 1])))
    return found


def matched(
    found: Sequence[Plateau], positions: Sequence[float], levels: Sequence[float], name: str
) -> list[tuple[int, float, Plateau]]:
    """Return repeat, position and plateau, in order.

    Where a round ends where the next begins, and nothing moved between, both are one plateau: it
    counts for the round that ends.

    Raises
    ------
    UsageError
        If their number fits no whole number of rounds.
    """
    count, size = len(found), len(positions)
    joined = size > 1 and positions[0] == positions[-1]
    rounds: list[tuple[int, float]] = []
    while len(rounds) < count:
        repeat = rounds[-1][0] + 1 if rounds else 1
        rounds += [(repeat, p) for p in positions]
    whole = count and count % size == 0
    if not whole and joined and count > size and (count - 1) % (size - 1) == 0:
        rounds = [(1, positions[0])]
        for repeat in range(1, (count - 1) // (size - 1) + 1):
            rounds += [(repeat, p) for p in positions[1:]]
        whole = True
    if not whole:
        said = ", ".join(
            f"{p.begin_s:.0f} s ({level:.0f})" for p, level in zip(found, levels, strict=True)
        )
        raise UsageError(
            f"{name}: {count} held positions found, expected {size} or a multiple of it:"
            f" {said or 'none'}; hold each for 2 s, or say what was set with --positions"
        )
    return [(r, float(p), one) for (r, p), one in zip(rounds[:count], found, strict=True)]
