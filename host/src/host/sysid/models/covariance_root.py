"""A root of a covariance, whatever the sizes of its entries."""

from __future__ import annotations

import numpy as np

from host.arrays import Array

ALIKE = 1e6  # times larger: eigenvectors still have four digits


def covariance_root(covariance: Array) -> Array:
    """Return R with R R' = covariance, (P, P); it may be singular.

    Deviations of unlike size are first scaled to one. With two parameters that nothing
    separates, with deviations of 1e11, eigenvectors of the bare matrix are rounding for all others:
    noise that is estimated with them gets 30 times its variance, and intervals four to nine
    times their width.

    Parameters
    ----------
    covariance : Array, shape (P, P)
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = deviation[deviation > 0.0]
    unlike = len(known) > 0 and float(known.max()) > ALIKE * float(known.min())
    scale = np.where(unlike & (deviation > 0.0), deviation, 1.0)
    value, vector = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vector * np.sqrt(np.maximum(value, 0.0)), dtype=np.float64)
