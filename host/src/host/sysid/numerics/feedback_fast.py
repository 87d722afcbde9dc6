"""The quick part of an input and of the signals it may follow, where its command is not known.

A guidance moves the command of an inner loop by what no column holds: a distance from a line, the
bearing of a waypoint. That is slow. A filter common to the input and all signals leaves their law
as it is, and takes such a command away: each sample less the parabola through its neighbourhood.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.differentiation import local_polynomial
from host.sysid.numerics.state_feedback import FeedbackLaw, feedback_law

NEIGHBOURHOOD_S = 0.8
ORDER = 2  # of the polynomial: a straight line leaves a third of a command's ramps (thor75)
FEWEST = 9  # samples in a neighbourhood
STARTS_S = (0.0, 0.04, 0.08)  # delays with which jumps of the command are looked for
REWEIGHTINGS = 15
TAIL = 1.5  # of Cauchy's weights, median absolute residuals
JUMP = 8.0  # median absolute residuals: more is a jump
MOST_JUMPS = 0.15  # of the samples: an input with more is a pilot's
AT_LIMIT = 0.98  # of the largest departure from the middle: there no law moves an input


def fast_feedback(
    dt_s: float,
    moved: Array,
    signals: Mapping[str, Array],
    windows: Sequence[IntArray],
    noise: Sequence[float] = (),
) -> FeedbackLaw | None:
    """Return the law that the quick part of an input follows; None if it follows none.

    Parameters
    ----------
    dt_s : float
        Sample period, s.
    moved : (n,) Array
        The input.
    signals : mapping of (n,) Array
        What it may follow.
    windows : sequence of IntArray
        Samples of each window; what is near a limit of the input is left out.
    noise : sequence of float
        Deviation of the white noise of the input and of each signal.
    """
    half = round(0.5 * NEIGHBOURHOOD_S / dt_s)
    if 2 * half + 1 < FEWEST:
        return None
    pieces = [p for w in windows for p in _inside(moved, w, half)]
    if not pieces:
        return None
    names = list(signals)
    values = np.column_stack([moved, *signals.values()])
    quick = np.zeros_like(values)
    for piece in pieces:
        around = np.arange(piece[0] - half, piece[-1] + half + 1)
        slow = local_polynomial(values[around], 2 * half + 1, ORDER)
        quick[around] = values[around] - slow
    pieces = _between_jumps(dt_s, quick, pieces, half)
    parts = {name: quick[:, 1 + k] for k, name in enumerate(names)}
    return feedback_law(dt_s, quick[:, 0], parts, pieces, noise)


def _inside(moved: Array, window: IntArray, half: int) -> list[IntArray]:
    """Return the samples of a window whose neighbourhood is in it and away from the limits."""
    own = moved[window]
    away = np.abs(own - np.median(own))
    limited = np.convolve(away >= AT_LIMIT * away.max(), np.ones(2 * half + 1), "same") > 0.5
    free = window[half : len(window) - half][~limited[half : len(window) - half]]
    return _runs(free, half)


def _between_jumps(
    dt_s: float, quick: Array, pieces: Sequence[IntArray], half: int
) -> list[IntArray]:
    """Return the pieces without samples that no law explains, if they are few."""
    rows = np.concatenate(pieces)
    left = min(
        (
            _robust_residual(quick[rows, 0], quick[np.maximum(rows - round(late / dt_s), 0), 1:])
            for late in STARTS_S
        ),
        key=lambda e: float(np.median(np.abs(e))),
    )
    jump = np.zeros(len(quick))
    jump[rows] = np.abs(left) > JUMP * np.median(np.abs(left))
    # A jump is in the quick part of its whole neighbourhood; in between it crosses zero.
    near = np.convolve(jump, np.ones(half // 2 + 1), "same") > 0.5
    if np.mean(near[rows]) > MOST_JUMPS:
        return list(pieces)
    return [run for piece in pieces for run in _runs(piece[~near[piece]], half)] or list(pieces)


def _robust_residual(moved: Array, signals: Array) -> Array:
    """Return what a law leaves of an input in which a few samples follow none."""
    weight = np.ones(len(moved))
    left = moved
    for _ in range(REWEIGHTINGS):
        gains, *_ = np.linalg.lstsq(signals * weight[:, None], moved * weight, rcond=None)
        left = moved - signals @ gains
        size = TAIL * max(float(np.median(np.abs(left))), 1e-12)
        weight = 1.0 / np.sqrt(1.0 + (left / size) ** 2)
    return left


def _runs(rows: IntArray, half: int) -> list[IntArray]:
    """Return rows one behind the other, of more than a neighbourhood."""
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    return [run for run in runs if len(run) > 2 * half]
