"""Inputs between their samples: lines that hold the mean of the motion, kinks included.

A linear model is driven by the line from sample to sample. A servo that starts at once and settles
leaves that line on one side of the motion: with kinks at samples of 10 ms, 0.3 ms late, which is
0.8 % of L_p at 20 rad/s. The mean over a sample is told by the curvature on both sides; one that is
far larger than its neighbours is a kink, and where it lies the two sides tell (subcell resolution:
Harten, J. Comput. Phys. 83, 1989). Samples of a smooth motion move by a twelfth of its curvature.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from host.arrays import Array

# Times the curvature beside it. A servo of second order and 30 rad/s has none at 10 ms, one of 60
# rad/s passes for one: 0.2 ms.
KINK_FROM = 4.0


def with_means_of_motion(values: Array) -> Array:
    """Return samples between which lines have the mean of the motion, sums of both sides equal.

    Parameters
    ----------
    values : Array, shape (n,)
        On an even grid. Steps and straight lines come back as they are.
    """
    if len(values) < 5:
        return values
    return _shared_by_samples(values, _mean_beside_line(values))


def with_means_of_smooth_motion(values: Array) -> Array:
    """Return the same of a motion without kinks that tell where they are.

    Commands that come every 20 ms bend a servo in every other sample of 10 ms: none stands out. A
    line cuts the bends off, w^2 dt^2 / 12 of a motion of w rad/s: at 20 rad/s 0.3 %, and so much
    too large were Cl_p and Cl_da. A cubic between samples does not, and is late nowhere.

    Parameters
    ----------
    values : Array, shape (n,)
        On an even grid. Steps come back as they are: the cubic does not overshoot (Fritsch &
        Carlson, SIAM J. Numer. Anal. 17, 1980).
    """
    if len(values) < 3:
        return values
    at = np.arange(len(values), dtype=np.float64)
    mean = np.diff(PchipInterpolator(at, values).antiderivative()(at))
    return _shared_by_samples(values, mean - 0.5 * (values[1:] + values[:-1]))


def _shared_by_samples(values: Array, missing: Array) -> Array:
    """Return samples moved by what the mean of each interval lacks, half of it at either end."""
    result = values.copy()
    result[:-1] += 0.5 * missing
    result[1:] += 0.5 * missing
    return result


def _mean_beside_line(values: Array) -> Array:
    """Return the mean of the motion less that of the line, of every interval, (n - 1,)."""
    bend = np.zeros(len(values) + 2)
    bend[2:-2] = np.diff(values, n=2)
    before, left, right, after = bend[:-3], bend[1:-2], bend[2:-1], bend[3:]
    jump_left, jump_right = left - before, right - after
    jump = jump_left + jump_right
    kinked = np.abs(jump_left) + np.abs(jump_right) > KINK_FROM * (np.abs(before) + np.abs(after))
    # A slope that jumps behind a share f of an interval: the line is f (1 - f) / 2 of it above.
    inside = jump_left * jump_right > 0.0
    by_kink = jump_left * jump_right / np.where(inside, 2.0 * jump, 1.0) + (before + after) / 24.0
    one_side = np.where(np.abs(left) < np.abs(right), left, right)
    at_end = np.where(np.abs(left) == np.abs(right), 0.5 * (left + right), one_side) / 12.0
    smooth = np.where(left * right > 0.0, left + right, 0.0) / 24.0
    return np.asarray(-np.where(kinked, np.where(inside, by_kink, at_end), smooth))
