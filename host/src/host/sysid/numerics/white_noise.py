"""White noise of a column, told from its motion by third differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array

MEDIAN_TO_SIGMA = 1.4826  # of a normal distribution
THIRD_DIFFERENCE_POWER = 20.0  # over that of white noise


def white_deviation(records: Sequence[Array]) -> Array:
    """Return the deviation of white noise of every column; quick motion counts little.

    Parameters
    ----------
    records : sequence of Array, each (samples, k) or (samples,)
    """
    third = np.abs(np.concatenate([np.diff(columns, n=3, axis=0) for columns in records]))
    return np.asarray(MEDIAN_TO_SIGMA * np.median(third, axis=0) / np.sqrt(THIRD_DIFFERENCE_POWER))
