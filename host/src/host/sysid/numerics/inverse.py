"""The inverse of an information matrix, whatever the units of its parameters."""

from __future__ import annotations

import numpy as np

from host.compiled import Array


def covariance_of(information: Array) -> Array:
    """Return the covariance an information matrix stands for, shape (P, P).

    Parameters
    ----------
    information : Array, shape (P, P)
        Symmetric; a row and column of zeros (nothing is known) gives zeros.

    Notes
    -----
    Rows and columns are scaled to a diagonal of ones first: a cut at the smallest digits would else
    take a parameter that is only known worse than another, or has other units, for one that is
    not known at all, and give it no variance.
    """
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled = information / scale[:, None] / scale
    inverse = np.linalg.pinv(0.5 * (scaled + scaled.T), hermitian=True)
    return np.asarray(inverse / scale[:, None] / scale, dtype=np.float64)
