"""Consider covariance: the one way of a systematic error into an interval.

An error of mass, of a sensor's place, of a calibration or of a delay is the same in every sample,
and more data do not average it away. Such an error is a consider parameter: it is not estimated,
but its standard deviation, from `host.instrument` or the aircraft file, counts in the covariance.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array

DOMINANT_SHARE = 0.25  # of the variance: an error with less is not named


def consider_covariance(shifts: Array) -> Array:
    """Return the covariance that systematic errors add, sum over errors k of s_k s_k', (P, P).

    EQUATIONS.md, eq. 35.

    Parameters
    ----------
    shifts : Array, shape (errors, P)
        Shift s_k of the estimate for one standard deviation of each error.
    """
    return np.asarray(shifts.T @ shifts)


def dominant_error_source(parts: dict[str, float], variance: float) -> str:
    """Return the error that causes most of a variance; empty if none causes a quarter of it.

    Parameters
    ----------
    parts : dict
        Variance that each error causes.
    variance : float
        Total, in the same unit.
    """
    if not parts:
        return ""
    cause = max(parts, key=parts.__getitem__)
    return cause if parts[cause] >= DOMINANT_SHARE * max(variance, 1e-300) else ""
