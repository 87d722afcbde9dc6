"""A long flight reduced to few points: minimum and maximum of each stretch of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray


@dataclass(frozen=True, slots=True)
class Buckets:
    """Rows by equal stretches of time.

    Attributes
    ----------
    t_s : (2 n,) array
        Two instants of each stretch, at a quarter and three quarters of it.
    first : (m,) array
        First row of each stretch that has any.
    filled : (m,) array
        Which stretches these are.
    """

    t_s: Array
    first: IntArray
    filled: IntArray


def buckets(t_s: Array, count: int) -> Buckets:
    """Divide the time of the rows into `count` equal stretches.

    Parameters
    ----------
    t_s : (rows,) array
        Rising, s.
    count : int
    """
    start, span = float(t_s[0]), max(float(t_s[-1] - t_s[0]), 1e-9)
    at = np.minimum(((t_s - start) * (count / span)).astype(np.int64), count - 1)
    first = np.flatnonzero(np.r_[True, np.diff(at) > 0])
    corners = (np.arange(2 * count) + 0.5) * (0.5 * span / count) + start
    return Buckets(corners, first, at[first])


def min_max(values: Array, own: Buckets) -> Array:
    """Return two values a stretch, the smallest and the largest in the order in which they came.

    Parameters
    ----------
    values : (rows,) array
        NaN where nothing was measured.
    own : Buckets

    Returns
    -------
    (2 n,) array
        NaN where a stretch has no value.
    """
    out = np.full(len(own.t_s), np.nan)
    lost = ~np.isfinite(values)
    low = np.minimum.reduceat(np.where(lost, np.inf, values), own.first)
    high = np.maximum.reduceat(np.where(lost, -np.inf, values), own.first)
    none = ~np.isfinite(low)
    low[none] = high[none] = np.nan
    # Falling over the stretch: the largest came first.
    last = np.r_[own.first[1:], len(values)] - 1
    falls = values[own.first] > values[last]
    out[2 * own.filled] = np.where(falls, high, low)
    out[2 * own.filled + 1] = np.where(falls, low, high)
    return out
