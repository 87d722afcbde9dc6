"""Legs of an input whose law has a command that jumps: a waypoint tracker's, turn by turn.

    u(t) = sum_k K_k * x_k(t - delay) + constant of the leg

In a leg whose inner command (bank) is at its limit, the outer signal (heading) is not followed. A
turn may begin there: at the limit for a moment, then without a jump behind the outer signal.
Gains come first from differences, in which a jump is an outlier, then in turn with the legs; these
by dynamic programming (Jackson et al., IEEE Signal Processing Letters 12, 2005, p. 105): a further
leg must be worth more than its constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from host.arrays import Array, IntArray

STEP_S = 0.1  # between samples that are compared
# Delay of servo and computer, and differences that the search starts with: of the longer ones few
# are of one leg where turns follow each other.
STARTS_S = ((0.04, 0.5), (0.04, 0.2), (0.08, 0.2))
SHORTEST_S = 2.0  # of a leg between two others: test inputs have shorter sides
LIMITED_S = 0.5  # at least, at the limit before the outer signal is followed
LONGEST_S = 20.0  # a longer one is cut, at the price of a constant
SETTLING_S = 0.35  # after a jump
ROUNDS = 5  # of gains and legs in turn
REWEIGHTINGS = 15
TAIL = 1.5  # of Cauchy's weights, median absolute residuals
LEAST_RESIDUAL = 1e-12
MEDIAN_SQUARE = 0.455  # of a normal variable of unit variance
PRICE = 4.0  # of a leg: log(n) variances of the residual
LEAST_PRICE = 0.004  # of the input's own variation
Part = tuple[Array, Array]  # of one window: input, and the signals before it


class Leg(NamedTuple):
    """Samples `first` to `last` - 1: is the outer signal followed, and did the command jump?"""

    first: int
    last: int
    follows: bool
    jumped: bool


def feedback_legs(
    dt_s: float, moved: Array, inner: Array, outer: Array | None, windows: Sequence[IntArray]
) -> tuple[list[IntArray], Array | None]:
    """Return the legs in some windows, and the outer signal, at rest where it is not followed.

    Parameters
    ----------
    dt_s : float
        Sample period, s.
    moved : (n,) Array
        The input.
    inner : (n, k) Array
        What it follows in every leg.
    outer : (n,) Array or None
        What it follows in some.
    windows : sequence of IntArray
        Samples of each window.
    """
    values = inner if outer is None else np.column_stack([inner, outer])
    stride = max(1, round(STEP_S / dt_s))
    settling = round(SETTLING_S / dt_s / stride)
    kept = [
        np.asarray(window)[::stride]
        for window in windows
        if len(window) * dt_s >= SHORTEST_S
        and np.isfinite(moved[window]).all()
        and np.isfinite(values[window]).all()
    ]
    if not kept:
        return [], outer
    starts = [
        (
            [(moved[rows], values[np.maximum(rows - round(delay_s / dt_s), 0)]) for rows in kept],
            max(1, round(difference_s / dt_s / stride)),
        )
        for delay_s, difference_s in STARTS_S
    ]
    found = _settled_legs(starts, stride * dt_s, settling, limited=outer is not None)
    resting = None if outer is None else outer.copy()
    legs: list[IntArray] = []
    for rows, own in zip(kept, found, strict=True):
        legs += _samples(rows, own, settling * stride, resting)
    return legs, resting


def _samples(
    rows: IntArray, own: Sequence[Leg], settling: int, resting: Array | None
) -> list[IntArray]:
    """Return the samples of the legs of a window; write into `resting` where it rests."""
    legs = []
    for leg in own:
        begin, end = int(rows[leg.first]), int(rows[leg.last - 1]) + 1  # a jump is between two rows
        if resting is not None and not leg.follows:
            resting[begin:end] = resting[begin]
        settled = begin + (settling if leg.jumped else 0)
        if end - settled > settling:
            legs.append(np.arange(settled, end))
    return legs


def _settled_legs(
    starts: Sequence[tuple[list[Part], int]], step_s: float, settling: int, *, limited: bool
) -> list[list[Leg]]:
    """Return the legs of each window that go with the gains that go with them.

    `starts` are the windows at a delay, and samples between differences; the search goes on from
    the start that costs least.
    """
    found: list[list[Leg]] = []
    least, parts = np.inf, starts[0][0]
    for some, apart in starts:
        gains = _gains_of_differences(some, apart)
        cost, legs = _legs(some, gains, step_s, limited=limited)
        if cost < least:
            least, found, parts = cost, legs, some
    for _ in range(ROUNDS):
        gains = _gains_of_legs(parts, found, settling)
        cost, legs = _legs(parts, gains, step_s, limited=limited)
        if cost >= least:
            break
        least, found = cost, legs
    return found


def _gains_of_differences(parts: Sequence[Part], apart: int) -> Array:
    """Return gains from differences over some samples, by Cauchy's weights."""
    du = np.concatenate([u[apart:] - u[:-apart] for u, _ in parts])
    dx = np.concatenate([x[apart:] - x[:-apart] for _, x in parts])
    weight = np.ones(len(du))
    for _ in range(REWEIGHTINGS):
        gains = np.linalg.lstsq(dx * weight[:, None], du * weight, rcond=None)[0]
        left = du - dx @ gains
        weight = 1.0 / np.hypot(1.0, left / (TAIL * np.median(np.abs(left)) + LEAST_RESIDUAL))
    return np.asarray(gains)


def _legs(
    parts: Sequence[Part], gains: Array, step_s: float, *, limited: bool
) -> tuple[float, list[list[Leg]]]:
    """Return what the legs leave and cost, and those of each window."""
    left = [[u - x @ gains] for u, x in parts]
    jumps = np.concatenate([np.diff(kinds[0]) for kinds in left])
    noise = float(np.median(jumps**2)) / MEDIAN_SQUARE / 2.0
    varied = sum(float(np.var(u)) * len(u) for u, _ in parts)
    count = sum(len(u) for u, _ in parts)
    price = max(PRICE * float(np.log(count)) * noise, LEAST_PRICE * varied)
    if limited:
        for kinds, (_, x) in zip(left, parts, strict=True):
            kinds.append(kinds[0] + x[:, -1] * gains[-1])
    seconds = (SHORTEST_S, LONGEST_S, LIMITED_S)
    shortest, longest, least = (round(length / step_s) for length in seconds)
    found = [_cheapest(kinds, (shortest, longest, least), price) for kinds in left]
    return sum(cost for cost, _ in found), [legs for _, legs in found]


def _cheapest(
    kinds: Sequence[Array], lengths: tuple[int, int, int], price: float
) -> tuple[float, list[Leg]]:
    """Return the least squares about the means of legs plus their price, and these legs.

    `kinds` are the residuals with the outer signal followed, and not; `lengths` the shortest leg,
    the longest, and the least time at the limit before the outer signal is followed. The first and
    the last leg may be short: a window cuts them.
    """
    count, (shortest, longest, least) = len(kinds[0]), lengths
    sums = np.array([np.concatenate([[0.0], np.cumsum(e)]) for e in kinds])
    squares = np.array([np.concatenate([[0.0], np.cumsum(e * e)]) for e in kinds])
    best = np.zeros(count + 1)
    limited, since = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=np.int64)
    back: list[list[Leg]] = [[]]
    for end in range(1, count + 1):
        first = np.arange(max(end - longest, 0), end)
        spread = squares[:, end, None] - squares[:, first]
        spread -= (sums[:, end, None] - sums[:, first]) ** 2 / (end - first)
        whole = best[first] + spread + price
        long = (end == count) | (first == 0) | (end - first >= shortest)
        costs = np.where(long, whole, np.inf)
        kind, at = divmod(int(np.argmin(costs)), len(first))
        best[end], begun = costs[kind, at], int(first[at])
        back.append([Leg(begun, end, kind == 0, begun > 0)])
        if len(kinds) == 1:
            continue
        turned = limited[first] + spread[0] + price
        long = (end == count) | (since[first] == 0) | (end - since[first] >= shortest)
        turned[~long | (end - first < least)] = np.inf
        at = int(np.argmin(turned))
        if turned[at] < best[end]:
            best[end], split, begun = turned[at], int(first[at]), int(since[first[at]])
            back[end] = [Leg(split, end, True, False), Leg(begun, split, False, begun > 0)]
        if end >= least:
            at = int(np.argmin(whole[1, : len(first) - least + 1]))
            limited[end], since[end] = whole[1, at], first[at]
    legs: list[Leg] = []
    end = count
    while end > 0:
        legs += back[end]
        end = back[end][-1].first
    return float(best[count]), legs[::-1]


def _gains_of_legs(parts: Sequence[Part], legs: Sequence[Sequence[Leg]], settling: int) -> Array:
    """Return gains by least squares, with a constant for each leg."""
    us, xs = [], []
    for (u, x), own in zip(parts, legs, strict=True):
        for leg in own:
            settled = slice(leg.first + (settling if leg.jumped else 0), leg.last)
            if settled.stop - settled.start < 2:
                continue
            moves = x[settled] - x[settled].mean(axis=0)
            if not leg.follows:
                moves[:, -1] = 0.0
            us.append(u[settled] - u[settled].mean())
            xs.append(moves)
    return np.asarray(np.linalg.lstsq(np.concatenate(xs), np.concatenate(us), rcond=None)[0])
