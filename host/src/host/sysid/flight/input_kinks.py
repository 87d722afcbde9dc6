"""Inputs between their samples: lines that hold the mean of the motion, kinks included.

A linear model is driven by the line from sample to sample. A servo that starts at once and settles
leaves that line on one side of the motion: with kinks at samples of 10 ms, 0.3 ms late, which is
0.8 % of L_p at 20 rad/s. The mean over a sample follows from the curvature on both sides. One that
is far larger than its neighbours is a kink, and the two sides say where it lies (subcell
resolution: Harten, J. Comput. Phys. 83, 1989). Samples of a smooth motion move by a twelfth of its
curvature.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.sysid.numerics.between_samples import shared_by_samples

# Times the curvature next to it. A servo of second order and 30 rad/s has none at 10 ms, one of 60
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
    return shared_by_samples(values, _mean_off_line(values))


def _mean_off_line(values: Array) -> Array:
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
