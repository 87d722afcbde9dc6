"""The inverse of an information matrix, whatever the units of its parameters."""

from __future__ import annotations

import numpy as np

from host.arrays import Array


def covariance_from_information(information: Array) -> Array:
    """Return the inverse of an information matrix, the Cramer-Rao covariance, shape (P, P).

    Parameters
    ----------
    information : Array, shape (P, P)
        Symmetric; a row and column of zeros (no information) gives zeros.

    Notes
    -----
    Rows and columns are first scaled to a unit diagonal. Otherwise a cut at the smallest digits
    would take a parameter in other units for one without information. A direction below those
    digits has no information: it gets the largest variance that the digits can express, so that
    parameters of two exactly collinear inputs are flagged.
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
