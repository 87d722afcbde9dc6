"""Covariance of a score whose residuals are coloured.

It is the middle factor of the covariance that corrects a white-noise fit (EQUATIONS.md, eq. 34).
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array

LAG_SHARE = 5  # a fifth of the record; a quarter loses one of 390 intervals on frozen answers


def coloured_score_covariance(residual: Array, sensitivities: Array) -> Array:
    """Return S' R S with sensitivities S and the residual's autocorrelation R.

    R is a Toeplitz matrix of the sample autocorrelation up to `LAG_SHARE` of the record
    (EQUATIONS.md, eq. 34).

    Parameters
    ----------
    residual : Array, shape (samples,)
    sensitivities : Array, shape (samples, columns)
        Sensitivities of the modelled output, by each parameter.

    Returns
    -------
    Array, shape (columns, columns)

    Notes
    -----
    Everything by FFT of more than two records' length, so nothing wraps. numpy alone: importing
    `scipy.signal` for two convolutions takes 0.4 s of an answer that takes three.
    """
    samples = len(residual)
    lags = samples // LAG_SHARE
    size = 1 << int(2 * samples - 1).bit_length()
    power = np.abs(np.fft.rfft(residual, size)) ** 2
    correlation = np.fft.irfft(power, size)[: lags + 1] / samples
    window = np.zeros(size)
    window[: lags + 1] = correlation
    window[size - lags :] = correlation[:0:-1]
    # A symmetric window has a real spectrum.
    weight = np.fft.rfft(window).real[:, None]
    moved = np.fft.irfft(np.fft.rfft(sensitivities, size, axis=0) * weight, size, axis=0)[:samples]
    return np.asarray(sensitivities.T @ moved, dtype=np.float64)
