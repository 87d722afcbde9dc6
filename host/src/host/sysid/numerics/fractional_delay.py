"""Delay of sampled signals by a fraction of a sample (Lagrange interpolation)."""

from __future__ import annotations

import numpy as np

from host.arrays import Array


def delay_columns(values: Array, shift: float) -> tuple[Array, Array]:
    """Delay each column by `shift` samples with cubic interpolation.

    Parameters
    ----------
    values : Array, shape (samples, columns)
        At least four samples; the first and last use the nearest four.
    shift : float
        Samples.

    Returns
    -------
    Array, Array
        The delayed columns and their derivative by the shift, of the shape of `values`.
    """
    samples = len(values)
    position = np.arange(samples) - shift
    base = np.clip(np.floor(position).astype(np.int64), 1, samples - 3)
    s = position - base
    # Lagrange's cubic polynomials for samples at -1, 0, 1 and 2, and their derivatives.
    weights = (
        -s * (s - 1.0) * (s - 2.0) / 6.0,
        (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
        -(s + 1.0) * s * (s - 2.0) / 2.0,
        (s + 1.0) * s * (s - 1.0) / 6.0,
    )
    rates = (
        -(3.0 * s * s - 6.0 * s + 2.0) / 6.0,
        (3.0 * s * s - 4.0 * s - 1.0) / 2.0,
        -(3.0 * s * s - 2.0 * s - 2.0) / 2.0,
        (3.0 * s * s - 1.0) / 6.0,
    )
    delayed, slope = np.zeros_like(values), np.zeros_like(values)
    for k, (weight, rate) in enumerate(zip(weights, rates, strict=True), start=-1):
        sample = values[base + k]
        delayed += weight[:, None] * sample
        slope -= rate[:, None] * sample
    return delayed, slope
