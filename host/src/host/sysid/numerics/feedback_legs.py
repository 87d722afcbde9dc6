"""Legs of an input whose law has a command that jumps: a waypoint tracker's, turn by turn.

    u(t) = sum_k K_k * x_k(t - delay) + constant of the leg

In a leg whose inner command (bank) is at its limit, the outer signal (heading) is not followed.
Gains come first from differences, in which a jump is an outlier, then in turn with the legs; these
by dynamic programming (Jackson et al., IEEE Signal Processing Letters 12, 2005, p. 105): a further
leg must be worth more than its constant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array, IntArray

STEP_S = 0.1  # between samples that are compared
DELAY_S = 0.05  # of servo and computer, about
DIFFERENCE_S = 0.5
SHORTEST_S = 2.0  # of a leg between two others: test inputs have shorter sides
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
Leg = tuple[int, int, bool]  # first, last + 1, whether the outer signal is followed


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
    late, settling = round(DELAY_S / dt_s), round(SETTLING_S / dt_s / stride)
    kept: list[IntArray] = []
    parts: list[Part] = []
    for window in windows:
        rows = np.asarray(window)[::stride]
        u, x = moved[rows], values[np.maximum(rows - late, 0)]
        if len(window) * dt_s >= SHORTEST_S and np.isfinite(u).all() and np.isfinite(x).all():
            kept.append(rows)
            parts.append((u, x))
    if not parts:
        return [], outer
    found = _settled_legs(parts, stride * dt_s, settling, limited=outer is not None)
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
    for first, last, follows in own:
        begin, end = int(rows[first]), int(rows[last - 1]) + 1  # a jump lies between two rows
        if resting is not None and not follows:
            resting[begin:end] = resting[begin]
        settled = begin + (settling if first else 0)
        if end - settled > settling:
            legs.append(np.arange(settled, end))
    return legs


def _settled_legs(
    parts: Sequence[Part], step_s: float, settling: int, *, limited: bool
) -> list[list[Leg]]:
    """Return the legs of each window that go with the gains that go with them."""
    gains = _gains_of_differences(parts, max(1, round(DIFFERENCE_S / step_s)))
    found: list[list[Leg]] = []
    for _ in range(ROUNDS):
        before, found = found, _legs(parts, gains, step_s, limited=limited)
        if found == before:
            break
        gains = _gains_of_legs(parts, found, settling)
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


def _legs(parts: Sequence[Part], gains: Array, step_s: float, *, limited: bool) -> list[list[Leg]]:
    """Return the legs of each window."""
    left = [[u - x @ gains] for u, x in parts]
    jumps = np.concatenate([np.diff(kinds[0]) for kinds in left])
    noise = float(np.median(jumps**2)) / MEDIAN_SQUARE / 2.0
    varied = sum(float(np.var(u)) * len(u) for u, _ in parts)
    count = sum(len(u) for u, _ in parts)
    price = max(PRICE * float(np.log(count)) * noise, LEAST_PRICE * varied)
    if limited:
        for kinds, (_, x) in zip(left, parts, strict=True):
            kinds.append(kinds[0] + x[:, -1] * gains[-1])
    lengths = round(SHORTEST_S / step_s), round(LONGEST_S / step_s)
    return [_cheapest(kinds, lengths, price) for kinds in left]


def _cheapest(kinds: Sequence[Array], lengths: tuple[int, int], price: float) -> list[Leg]:
    """Return the legs of least squares about their means plus their price.

    `kinds` are the residuals with the outer signal followed, and not. The first and the last leg
    may be short: a window cuts them.
    """
    count, (shortest, longest) = len(kinds[0]), lengths
    sums = np.array([np.concatenate([[0.0], np.cumsum(e)]) for e in kinds])
    squares = np.array([np.concatenate([[0.0], np.cumsum(e * e)]) for e in kinds])
    best, begin, kind = np.zeros(count + 1), [0] * (count + 1), [0] * (count + 1)
    for end in range(1, count + 1):
        since = max(end - longest, 0)
        first = np.arange(since, end)
        spread = squares[:, end, None] - squares[:, first]
        spread -= (sums[:, end, None] - sums[:, first]) ** 2 / (end - first)
        cost = best[first] + spread.min(axis=0) + price
        if end < count:
            cost[(end - first < shortest) & (first > 0)] = np.inf
        at = int(np.argmin(cost))
        best[end], begin[end] = cost[at], since + at
        kind[end] = int(np.argmin(spread[:, at]))
    legs: list[Leg] = []
    end = count
    while end > 0:
        legs.append((begin[end], end, kind[end] == 0))
        end = begin[end]
    return legs[::-1]


def _gains_of_legs(parts: Sequence[Part], legs: Sequence[Sequence[Leg]], settling: int) -> Array:
    """Return gains by least squares, with a constant for each leg."""
    us, xs = [], []
    for (u, x), own in zip(parts, legs, strict=True):
        for first, last, follows in own:
            leg = slice(first + (settling if first else 0), last)
            if leg.stop - leg.start < 2:
                continue
            moves = x[leg] - x[leg].mean(axis=0)
            if not follows:
                moves[:, -1] = 0.0
            us.append(u[leg] - u[leg].mean())
            xs.append(moves)
    return np.asarray(np.linalg.lstsq(np.concatenate(xs), np.concatenate(us), rcond=None)[0])
