"""The one way of a systematic error into an interval: by what one deviation of it does.

An error of mass, of a sensor's place, of a calibration or of a delay is the same in every sample:
more data do not average it away. What is not estimated of it is considered: the answer moves by s_k
for one standard deviation of error k, and its covariance grows by the sum of s_k s_k' (Tapley,
Schutz & Born, Statistical Orbit Determination, ch. 6, consider covariance). The deviations come
from `host.instrument` and the aircraft file.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array

DOMINANT_SHARE = 0.25  # of the variance: a cause with less is not worth naming


def consider_covariance(shifts: Array) -> Array:
    """Return what systematic errors add to a covariance, (P, P).

    Parameters
    ----------
    shifts : (errors, P) Array
        Of the answer, by one standard deviation of each error.
    """
    return np.asarray(shifts.T @ shifts)


def dominant_error_source(parts: dict[str, float], variance: float) -> str:
    """Return the cause of most of a variance; nothing where none has a quarter of it."""
    if not parts:
        return ""
    cause = max(parts, key=parts.__getitem__)
    return cause if parts[cause] >= DOMINANT_SHARE * max(variance, 1e-300) else ""
