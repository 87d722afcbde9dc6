"""Inputs without edges: multisines and sweeps whose swings go on for many seconds.

A swing is the range of a surface over two seconds. In an input it stands out of what the pilot does
in the rest of the flight; a record that was cut to its input has no rest.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array, BoolArray

HALF_S = 1.0  # of the window of a swing
QUIET = 0.2  # quantile: the quietest fifth of a flight has no input
ABOVE = 4.0  # swings of an input over those of the quiet fifth of the flight
SMALL, LOW_SHARE = 0.2, 0.5  # of its own swings, of the least: it goes on
CUT_S = 60.0  # a record no longer than this may have been cut to its input, and hardly have a rest
NO_REST = 10.0  # its large swings over its quiet ones, where it has none
SHORTEST_S = 5.0
SMOOTHED_S = 0.2
FEWEST_TURNS = 4  # of the surface about its middle


def sustained_inputs(
    t: Array, series: Array, flying: BoolArray, least: float
) -> list[tuple[int, int]]:
    """Return the first and last sample of each input that goes on.

    Parameters
    ----------
    t, series : Array, shape (n,)
        Time, s, on an even grid, and a surface, rad, or the throttle.
    flying : Array, shape (n,)
    least : float
        Smallest swing of an input.
    """
    dt_s = float(np.median(np.diff(t)))
    half = max(1, round(HALF_S / dt_s))
    if not flying.any():
        return []
    swing = _swing(series, half)
    cut = flying.sum() * dt_s <= CUT_S
    quiet = float(np.quantile(swing[flying], 0.05 if cut else QUIET))
    if cut and float(np.max(swing[flying])) < NO_REST * quiet:
        quiet = 0.0
    active = flying & (swing > ABOVE * quiet) & (_swing(_smoothed(series, dt_s), half) > least)
    found: list[tuple[int, int]] = []
    for first, last in _spans(active):
        # Slow swings at both ends belong to it: small against its own, but no rest yet.
        own = SMALL * float(np.median(swing[first : last + 1]))
        going = flying & (swing > max(own, ABOVE * quiet, LOW_SHARE * least))
        first, last = _run_about(going, first, last)
        if found and first <= found[-1][1]:
            first = found.pop()[0]
        found.append((first, last))
    # The window of a swing reaches the input before its middle does.
    inner = [
        (first + half if first > 0 else first, last - half if last < len(t) - 1 else last)
        for first, last in found
    ]
    return [
        (first, last)
        for first, last in inner
        if (last - first) * dt_s >= SHORTEST_S and _turns(series[first : last + 1]) >= FEWEST_TURNS
    ]


def _run_about(going: BoolArray, first: int, last: int) -> tuple[int, int]:
    """Return the first and last sample of what goes on without a rest about a span."""
    before, after = np.flatnonzero(~going[:first]), np.flatnonzero(~going[last + 1 :])
    begun = int(before[-1]) + 1 if len(before) else 0
    return begun, last + int(after[0]) if len(after) else len(going) - 1


def _swing(series: Array, half: int) -> Array:
    """Return the range of a surface about each sample."""
    return running_maximum(series, half) + running_maximum(-series, half)


def _smoothed(series: Array, dt_s: float) -> Array:
    """Return the means about each sample: noise of a pot swings as far as a small input."""
    size = 2 * round(0.5 * SMOOTHED_S / dt_s) + 1
    padded = np.pad(series, size // 2, mode="edge")
    sums = np.cumsum(np.concatenate([[0.0], padded]))
    return np.asarray((sums[size:] - sums[:-size]) / size)


def running_maximum(series: Array, half: int) -> Array:
    """Return the maximum of `half` samples before and behind each: that of the rest of one block
    and of the beginning of the next.

    `scipy.ndimage` has the same; loading it takes 0.1 s.
    """
    size = 2 * half + 1
    blocks = -(-(len(series) + 2 * half) // size)
    padded = np.full(blocks * size, -np.inf)
    padded[half : half + len(series)] = series
    rows = padded.reshape(blocks, size)
    begun = np.maximum.accumulate(rows, axis=1).ravel()
    rest = np.maximum.accumulate(rows[:, ::-1], axis=1)[:, ::-1].ravel()
    return np.asarray(np.maximum(rest[: len(series)], begun[size - 1 : size - 1 + len(series)]))


def _spans(active: BoolArray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], active, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def _turns(series: Array) -> int:
    """Return how often a surface goes from one side of its middle to the other, noise aside."""
    about = series - np.median(series)
    side = np.sign(about[np.abs(about) > 0.15 * np.max(np.abs(about))])
    return int(np.sum(np.diff(side) != 0.0))
