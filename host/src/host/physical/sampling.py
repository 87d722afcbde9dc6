"""Interpolate values from their sampling instants to the instants of the rows.

Linear between the two samples around the instant; no value where one of the two is invalid, or
where they lie further apart than 1.5 times the usual interval (a sample between them is missing).
Of slow rows (the radio's 20 a second) a cubic through four samples: a line takes 4 % off a motion
of 2.7 Hz at 20 Hz and a delay of 7 ms, and as much off the derivatives that are fitted to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GAP_FACTOR = 1.5
SLOW_US = 30_000.0  # between rows: faster ones lose less than 0.5 % to a line at 3 Hz
_UNEVEN = 0.25  # of the usual interval: such neighbours are no samples of an even row


class Interpolator:
    """Weights that bring samples of one group of channels to the instants of the rows.

    Parameters
    ----------
    sampled_us : Array, shape (n,)
        Sampling instants, not falling.
    rows_us : Array, shape (m,)
        Instants wanted, not falling.
    interval_us : float
        Usual time between two samples.

    Notes
    -----
    Where each row has its sample (n = m, a constant delay below one interval) no search is made:
    the neighbours are row i and row i - 1 or i + 1.
    """

    def __init__(self, sampled_us: Array, rows_us: Array, interval_us: float) -> None:
        self._shift: int | None = None
        self._rows = len(rows_us)
        self._index: NDArray[np.intp] | None = None
        self._exact = False
        self._sampled_us = sampled_us if SLOW_US < interval_us < np.inf else None
        limit_us = GAP_FACTOR * interval_us
        if len(sampled_us) < 2:
            self._weight = np.full(self._rows, np.nan)
            self._index = np.zeros(self._rows, np.intp)
            self._few = True
            return
        self._few = False
        self._exact = len(sampled_us) == self._rows and bool((sampled_us == rows_us).all())
        if self._exact:
            return
        step = np.diff(sampled_us)
        if len(sampled_us) == self._rows and self._sampled_us is None:
            shift = self._fixed_shift(sampled_us, rows_us)
            if shift is not None:
                self._shift = shift
                # rows i whose earlier neighbour is sample i + shift (shift 0 or -1)
                first, last = (0, self._rows - 1) if shift == 0 else (1, self._rows)
                weight = np.full(self._rows, np.nan)
                span = weight[first:last]
                np.subtract(rows_us[first:last], sampled_us[: self._rows - 1], out=span)
                with np.errstate(divide="ignore", invalid="ignore"):
                    span /= step
                span[step > limit_us] = np.nan
                self._weight = weight
                return
        index = np.searchsorted(sampled_us, rows_us, side="right") - 1
        inside = (index >= 0) & (index < len(sampled_us) - 1)
        at_last = rows_us == sampled_us[-1]
        inside |= at_last
        index = np.clip(index, 0, len(sampled_us) - 2)
        gap = step[index]
        with np.errstate(divide="ignore", invalid="ignore"):
            weight = (rows_us - sampled_us[index]) / gap
        # Where a clock runs backwards (a forged log) the neighbours do not hold the instant.
        between = (weight >= 0.0) & (weight <= 1.0)
        weight[~inside | ~between | (gap > limit_us)] = np.nan
        self._weight, self._index = weight, index

    def __call__(self, values: Array) -> Array:
        """Return `values` at the rows.

        Parameters
        ----------
        values : Array, shape (n,)

        Returns
        -------
        Array, shape (m,)
            NaN where there is no value.
        """
        if self._few:
            return np.full(self._rows, np.nan)
        if self._exact:
            return values
        out = np.empty(self._rows)
        if self._shift is not None:
            first, last = (0, self._rows - 1) if self._shift == 0 else (1, self._rows)
            core = out[first:last]
            np.subtract(values[1:], values[:-1], out=core)
            core *= self._weight[first:last]
            core += values[:-1]
            out[:first] = np.nan
            out[last:] = np.nan
            return out
        assert self._index is not None
        low = values[self._index]
        np.subtract(values[self._index + 1], low, out=out)
        out *= self._weight
        out += low
        if self._sampled_us is not None:
            out += bend(self._sampled_us, values, self._index, self._weight)
        return out

    @staticmethod
    def _fixed_shift(sampled_us: Array, rows_us: Array) -> int | None:
        if bool((sampled_us <= rows_us).all()) and bool((sampled_us[1:] > rows_us[:-1]).all()):
            return 0
        if bool((sampled_us >= rows_us).all()) and bool((sampled_us[:-1] <= rows_us[1:]).all()):
            return -1
        return None


class ConstantDelay:
    """Brings channels sampled a little after each row to the row's instant.

    The analogue channels are converted 1.7 to 2.7 ms after the trigger: the sample before and the
    one behind the instant belong to the row before and to the row itself.

    Parameters
    ----------
    rows_us : Array, shape (n,)
        Instants of the rows, not falling.
    interval_us : float
        Usual time between two rows.
    """

    def __init__(self, rows_us: Array, interval_us: float) -> None:
        step = np.diff(rows_us)
        self.shortest_us = float(step.min()) if len(step) else 0.0
        with np.errstate(divide="ignore"):
            self._inverse = 1.0 / step
        self._inverse[step > GAP_FACTOR * interval_us] = np.nan

    def __call__(self, values: Array, late_us: float) -> Array:
        """Return `values`, sampled `late_us` behind each row, at the rows.

        Parameters
        ----------
        values : Array, shape (n,)
        late_us : float
            At most `shortest_us`.
        """
        out = np.empty_like(values)
        core = out[1:]
        np.subtract(values[1:], values[:-1], out=core)
        core *= self._inverse
        core *= late_us
        np.subtract(values[1:], core, out=core)
        out[:1] = np.nan
        return out


def bend(sampled: Array, values: Array, index: NDArray[np.intp], weight: Array) -> Array:
    """Return the difference between a cubic through four samples and the line between the inner
    two.

    Where the samples are uneven or one has no value the parabola through three, else nothing.

    Parameters
    ----------
    sampled : Array, shape (n,)
        Instants, in any unit.
    values : Array, shape (n,)
    index : NDArray, shape (m,)
        Index of the sample before each instant wanted.
    weight : Array, shape (m,)
        Weight of the sample behind it, 0 to 1.

    Returns
    -------
    Array, shape (m,)
    """
    if len(values) < 3:
        return np.zeros(len(index))
    step = np.diff(sampled)
    usual = float(np.median(step))
    even = np.abs(step - usual) < _UNEVEN * usual
    curve = np.full(len(values), np.nan)
    curve[1:-1] = np.where(even[1:] & even[:-1], np.diff(values, n=2), np.nan)
    before, behind = curve[index], curve[np.minimum(index + 1, len(values) - 1)]
    before = np.where(np.isfinite(before), before, behind)
    behind = np.where(np.isfinite(behind), behind, before)
    more = -weight * (1.0 - weight) / 6.0 * ((2.0 - weight) * before + (1.0 + weight) * behind)
    return np.where(np.isfinite(more), more, 0.0)


def usual_interval_us(sampled_us: Array) -> float:
    """Return the median time between samples, microseconds; infinity without two of them."""
    if len(sampled_us) < 2:
        return float("inf")
    return float(np.median(np.diff(sampled_us)))
