"""The inverse of an information matrix, whatever the units of its parameters."""

from __future__ import annotations

import numpy as np

from host.arrays import Array


def covariance_from_information(information: Array) -> Array:
    """Return the covariance an information matrix stands for, shape (P, P).

    Parameters
    ----------
    information : Array, shape (P, P)
        Symmetric; a row and column of zeros (nothing is known) gives zeros.

    Notes
    -----
    Rows and columns are scaled to a diagonal of ones first: a cut at the smallest digits would else
    take a parameter that is only known worse than another, or has other units, for one that is
    not known at all. A direction below those digits is not known at all: it gets the largest
    variance that they can tell, not none, so that two inputs mixed exactly are refused.
    """
    live = np.flatnonzero(np.diag(information) > 0.0)
    if len(live) == 0:
        return np.zeros_like(information)
    scale = np.sqrt(np.diag(information)[live])
    scaled = information[np.ix_(live, live)] / scale[:, None] / scale
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    least = len(live) * np.finfo(np.float64).eps * float(values[-1])
    inverse = (vectors / np.maximum(values, least)) @ vectors.T
    result = np.zeros_like(information)
    result[np.ix_(live, live)] = inverse / scale[:, None] / scale
    return np.asarray(result, dtype=np.float64)
