"""The inverse of an information matrix, whatever the units of its parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from host.arrays import Array

LEAST_IDENTIFIED = 1e-11  # of the largest eigenvalue of the scaled matrix


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
    return _inverse(information, lambda values: np.maximum(values, _digits(values)))


def identified_inverse(information: Array) -> Array:
    """Return the inverse of an information matrix along the directions that have information.

    For projections: a direction without any moves no output, and its largest variance times the
    rounding of its sensitivity would be a number of any size.

    Parameters
    ----------
    information : Array, shape (P, P)
        As of `covariance_from_information`.
    """
    return _inverse(
        information,
        lambda values: np.where(values > LEAST_IDENTIFIED * float(values[-1]), values, np.inf),
    )


def _digits(values: Array) -> float:
    return len(values) * float(np.finfo(np.float64).eps) * float(values[-1])


def _inverse(information: Array, bounded: Callable[[Array], Array]) -> Array:
    live = np.flatnonzero(np.diag(information) > 0.0)
    if len(live) == 0:
        return np.zeros_like(information)
    scale = np.sqrt(np.diag(information)[live])
    scaled = information[np.ix_(live, live)] / scale[:, None] / scale
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    inverse = (vectors / bounded(values)) @ vectors.T
    result = np.zeros_like(information)
    result[np.ix_(live, live)] = inverse / scale[:, None] / scale
    return np.asarray(result, dtype=np.float64)
