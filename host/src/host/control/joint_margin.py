"""Margin of two loops that change together: gain and phase of both at once."""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.control.margins import Spectra


def joint_disk(loop: Spectra) -> Array:
    """Return the disk margin of two loops broken together, shape (N,).

    Each loop may turn by its own (1 + d / 2) / (1 - d / 2) with |d| below the margin (Seiler,
    Packard & Gahinet 2020, balanced sensitivity). It is 1 over the largest structured singular
    value of S - 1/2. Scaling by a diagonal D is exact for two complex blocks (Packard & Doyle
    1993), and of a matrix of two by two its best D is known: that of equal off-diagonal sizes.

    Parameters
    ----------
    loop : Array, shape (N, F, 2, 2)
        L at the actuators, negative feedback.
    """
    one = np.eye(2)
    m = np.linalg.inv(one + loop) - 0.5 * one
    return np.asarray(np.minimum(1.0 / np.max(structured_value(m), axis=-1), 2.0))


def structured_value(matrix: Spectra) -> Array:
    """Return the structured singular value of matrices of two by two, two complex blocks of one.

    The squared sizes of D M 1/D add up to t, their product is |det M|^2 whatever D is: the larger
    one falls with t, and t is least where both off-diagonal entries are as large.

    Parameters
    ----------
    matrix : Array, shape (..., 2, 2)
    """
    size = np.abs(matrix)
    trace = size[..., 0, 0] ** 2 + size[..., 1, 1] ** 2 + 2.0 * size[..., 0, 1] * size[..., 1, 0]
    product = np.abs(np.linalg.det(matrix)) ** 2
    root = np.sqrt(np.maximum(trace**2 - 4.0 * product, 0.0))
    return np.asarray(np.sqrt(0.5 * (trace + root)))
