"""Smooth and differentiate with a bandwidth that is known, not guessed (Savitzky-Golay).

A local polynomial is a linear-phase filter: it delays nothing. Its window is chosen from the
frequency at which the smoothed signal has fallen to half power, computed from the filter itself.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import signal

from host.compiled import Array
from host.sysid.errors import IdentificationError

POLYNOMIAL = 3
SMALLEST_WINDOW = 5
HEADROOM = 1.5  # bandwidth over the highest frequency at which a signal stands out of its noise
STANDS_OUT = 6.0  # times the noise floor


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
    taps = signal.savgol_coeffs(window, POLYNOMIAL)
    frequency, response = signal.freqz(taps, worN=8192)
    below = np.flatnonzero(np.abs(response) < np.sqrt(0.5))
    edge = frequency[below[0]] if len(below) else np.pi
    return float(edge / (2.0 * np.pi * dt_s))


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
    filtered = signal.savgol_filter(values, window, POLYNOMIAL, axis=0)
    # Five-point differences of the smoothed signal: exact far beyond the smoothing bandwidth, so
    # that states, rates and inputs carry one and the same filter: the regression is unbiased.
    rate = signal.savgol_filter(filtered, 5, 4, deriv=1, delta=dt_s, axis=0)
    return np.asarray(filtered, dtype=np.float64), np.asarray(rate, dtype=np.float64)


def smooth(values: Array, dt_s: float, bandwidth: float) -> Array:
    """Return values smoothed with the same filter as `smooth_and_differentiate`."""
    window = window_for(bandwidth, dt_s, len(values))
    return np.asarray(signal.savgol_filter(values, window, POLYNOMIAL, axis=0), dtype=np.float64)


def signal_bandwidth_hz(values: Array, dt_s: float) -> float:
    """Return a bandwidth that keeps what stands out of the noise of any column, Hz.

    The noise floor is the median of the upper half of each periodogram.
    """
    samples = len(values)
    window = np.hanning(samples)[:, None]
    detrended = signal.detrend(values, axis=0)
    power = np.abs(np.fft.rfft(detrended * window, axis=0)) ** 2
    frequency = np.fft.rfftfreq(samples, dt_s)
    lines = max(3, len(frequency) // 100)
    kernel = np.ones(lines) / lines
    edge = 4.0 / (samples * dt_s)
    for column in power.T:
        level = np.convolve(column, kernel, mode="same")
        floor = float(np.median(level[len(level) // 2 :]))
        above = np.flatnonzero(level > STANDS_OUT * floor)
        if floor > 0.0 and len(above):
            edge = max(edge, float(frequency[above[-1]]))
        elif floor <= 0.0:
            edge = float(frequency[-1])
    return min(HEADROOM * edge, 0.4 / dt_s)
