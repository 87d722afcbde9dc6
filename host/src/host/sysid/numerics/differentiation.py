"""Smooth and differentiate signals with a known bandwidth (Savitzky-Golay).

A local polynomial is a linear-phase filter: it delays nothing. The window follows from the
half-power frequency, which is computed from the filter's own frequency response. It is written out
in numpy: `scipy.signal.savgol_filter` is the same, and its import takes a third of an answer's
processor time (1.0 of 3.0 s for the card `demo`, measured together).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError

POLYNOMIAL = 3  # the cubic of Savitzky & Golay
SMALLEST_WINDOW = POLYNOMIAL + 2  # odd, and more samples than coefficients
HEADROOM = 1.5  # bandwidth over the highest frequency at which a signal exceeds its noise
SIGNAL_TO_FLOOR = 6.0  # power of a signal over the noise floor
RESPONSE_LINES = 8192  # of a window's frequency response, to pi per sample


@lru_cache(maxsize=64)
def _projection(window: int, order: int, derivative: int) -> Array:
    """Return the matrix from a window of samples to the value of its polynomial at each."""
    half = (window - 1) // 2
    place = np.arange(-half, half + 1) / max(half, 1)
    powers = place[:, None] ** np.arange(order + 1)
    slopes = np.zeros_like(powers)
    for k in range(derivative, order + 1):
        factor = np.prod(np.arange(k - derivative + 1, k + 1)) if derivative else 1.0
        slopes[:, k] = factor * place ** (k - derivative)
    return np.asarray(slopes @ np.linalg.pinv(powers) / max(half, 1) ** derivative)


def local_polynomial(
    values: Array, window: int, order: int, *, derivative: int = 0, dt_s: float = 1.0
) -> Array:
    """Fit a polynomial around every sample and return its value or derivative there.

    The values are c * y with the convolution weights c of Savitzky & Golay, Analytical Chemistry 36
    (1964). Within half a window of an end the polynomial of the last whole window is evaluated.

    Parameters
    ----------
    values : Array, shape (samples, columns)
    window : int
        Odd number of samples, at most those there are.
    order, derivative : int
    dt_s : float
        Sample period, s.

    Returns
    -------
    Array, shape (samples, columns)
        In the units of `values` per second to the power of `derivative`.
    """
    matrix = _projection(window, order, derivative) / dt_s**derivative
    half = (window - 1) // 2
    result = np.empty_like(values, dtype=np.float64)
    for k, column in enumerate(values.T):
        result[half : len(values) - half, k] = np.convolve(column, matrix[half][::-1], "valid")
    result[:half] = matrix[:half] @ values[:window]
    result[len(values) - half :] = matrix[half + 1 :] @ values[-window:]
    return result


@lru_cache(maxsize=512)
def bandwidth_hz(window: int, dt_s: float) -> float:
    """Return the half-power frequency of a smoothing window, Hz.

    Parameters
    ----------
    window : int
        Odd number of samples, at least 5.
    dt_s : float
        Sample period, s.
    """
    taps = _projection(window, POLYNOMIAL, 0)[(window - 1) // 2]
    response = np.abs(np.fft.rfft(taps, 2 * RESPONSE_LINES))
    below = np.flatnonzero(response < np.sqrt(0.5))
    edge = below[0] / RESPONSE_LINES if len(below) else 1.0
    return float(edge / (2.0 * dt_s))


def window_for(bandwidth: float, dt_s: float, samples: int) -> int:
    """Return the longest odd window whose half-power frequency is at least `bandwidth` Hz.

    Raises
    ------
    IdentificationError
        If the record is shorter than the smallest window.
    """
    if samples < SMALLEST_WINDOW:
        raise IdentificationError(
            f"{samples} samples are too few to differentiate, {SMALLEST_WINDOW} are needed"
        )
    longest = min(samples - 1 + samples % 2, 401)
    low, high = (SMALLEST_WINDOW - 1) // 2, (longest - 1) // 2
    while low < high:
        middle = (low + high + 1) // 2
        if bandwidth_hz(2 * middle + 1, dt_s) >= bandwidth:
            low = middle
        else:
            high = middle - 1
    return 2 * low + 1


def smooth_and_differentiate(values: Array, dt_s: float, bandwidth: float) -> tuple[Array, Array]:
    """Return smoothed values and rates, both of shape (samples, columns).

    Parameters
    ----------
    values : Array, shape (samples, columns)
        Measured signals.
    dt_s : float
        Sample period, s.
    bandwidth : float
        Half-power frequency of the smoothing, Hz.
    """
    window = window_for(bandwidth, dt_s, len(values))
    filtered = local_polynomial(values, window, POLYNOMIAL)
    # Five-point differences of the smoothed signal: exact far beyond the smoothing bandwidth, so
    # that states, rates and inputs carry one and the same filter: the regression is unbiased.
    return filtered, local_polynomial(filtered, 5, 4, derivative=1, dt_s=dt_s)


def smooth(values: Array, dt_s: float, bandwidth: float) -> Array:
    """Return values smoothed with the same filter as `smooth_and_differentiate`."""
    return local_polynomial(values, window_for(bandwidth, dt_s, len(values)), POLYNOMIAL)


def signal_bandwidth_hz(values: Array, dt_s: float) -> float:
    """Return a bandwidth that keeps the signal content of every column, Hz.

    The noise floor is the median of the upper half of each periodogram.

    Parameters
    ----------
    values : Array, shape (samples, columns)
    dt_s : float
        Sample period, s.
    """
    samples = len(values)
    ramp = np.linspace(-1.0, 1.0, samples)  # has no mean, so mean and slope are independent
    slope = (ramp @ values) / max(float(ramp @ ramp), 1e-300)
    detrended = values.T - np.mean(values, axis=0)[:, None] - slope[:, None] * ramp
    power = np.abs(np.fft.rfft(detrended * _taper(samples))) ** 2
    frequency = np.fft.rfftfreq(samples, dt_s)
    lines = max(3, len(frequency) // 100)
    kernel = np.ones(lines) / lines
    edge = 4.0 / (samples * dt_s)
    for column in power:
        level = np.convolve(column, kernel, mode="same")
        upper = level[len(level) // 2 :]
        floor = float(np.partition(upper, len(upper) // 2)[len(upper) // 2])
        above = np.flatnonzero(level > SIGNAL_TO_FLOOR * floor)
        if floor > 0.0 and len(above):
            edge = max(edge, float(frequency[above[-1]]))
        elif floor <= 0.0:
            edge = float(frequency[-1])
    return min(HEADROOM * edge, 0.4 / dt_s)


@lru_cache(maxsize=8)
def _taper(samples: int) -> Array:
    return np.hanning(samples)
