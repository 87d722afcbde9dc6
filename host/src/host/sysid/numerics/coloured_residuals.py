"""What coloured residuals do to a covariance: the middle of the usual sandwich.

Morelli & Klein, Accuracy of aerodynamic model parameters estimated from flight test data, Journal
of Guidance, Control and Dynamics 20 (1997): the residual's autocorrelation up to a fifth of the
record stands between the slopes.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array

LAG_SHARE = 5  # a fifth of the record


def coloured_score_covariance(residual: Array, slopes: Array) -> Array:
    """Return slopes' R slopes with the residual's autocorrelation R, shape (columns, columns).

    Parameters
    ----------
    residual : Array, shape (samples,)
    slopes : Array, shape (samples, columns)

    Notes
    -----
    Everything by FFT of more than two records' length, so nothing wraps. numpy alone: importing
    `scipy.signal` for two convolutions takes 0.4 s of an answer that takes three.
    """
    samples = len(residual)
    lags = samples // LAG_SHARE
    size = 1 << int(2 * samples - 1).bit_length()
    power = np.abs(np.fft.rfft(residual, size)) ** 2
    correlation = np.fft.irfft(power, size) / samples
    window = np.zeros(size)
    window[: lags + 1] = correlation[: lags + 1]
    window[size - lags :] = correlation[size - lags :]
    # A symmetric window has a real spectrum.
    weight = np.fft.rfft(window).real[:, None]
    spread = np.fft.irfft(np.fft.rfft(slopes, size, axis=0) * weight, size, axis=0)[:samples]
    return np.asarray(slopes.T @ spread, dtype=np.float64)
