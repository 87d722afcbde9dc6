"""White noise of a column, separated from its motion by third differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array
from host.constants import MEDIAN_TO_SIGMA

if TYPE_CHECKING:
    from host.sysid.models.maneuver import Maneuver

THIRD_DIFFERENCE_POWER = 20.0  # over that of white noise: 1 + 9 + 9 + 1


def white_deviation(records: Sequence[Array]) -> Array:
    """Return the deviation of white noise of every column; quick motion counts little.

    Parameters
    ----------
    records : sequence of Array, each (samples, k) or (samples,)
    """
    third = np.abs(np.concatenate([np.diff(columns, n=3, axis=0) for columns in records]))
    return np.asarray(MEDIAN_TO_SIGMA * np.median(third, axis=0) / np.sqrt(THIRD_DIFFERENCE_POWER))


def noise_deviation(maneuvers: Sequence[Maneuver]) -> Array:
    """Return the deviation of white output noise from third differences (20 times its power)."""
    stacked = np.vstack([np.diff(m.outputs, n=3, axis=0) for m in maneuvers])
    floor = 1e-6 * np.max(np.abs(np.vstack([m.outputs for m in maneuvers])), axis=0) + 1e-12
    return np.asarray(
        np.maximum(np.sqrt(np.mean(stacked**2, axis=0) / THIRD_DIFFERENCE_POWER), floor)
    )
