"""Delay of sampled signals by a fraction of a sample (Lagrange interpolation)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from host.arrays import Array

Weights = Callable[[Array], tuple[Array, Array, Array, Array]]


def delay_columns(values: Array, shift: float) -> Array:
    """Delay each column by `shift` samples with cubic interpolation.

    Parameters
    ----------
    values : Array, shape (samples, columns)
        At least four samples; the first and last use the nearest four.
    shift : float
        Samples.

    Returns
    -------
    Array, shape (samples, columns)
    """
    return _interpolated(values, shift, _cubics)


def slope_by_delay(values: Array, shift: float) -> Array:
    """Return the derivative of `delay_columns` by the shift, of the shape of `values`."""
    return _interpolated(values, shift, _slopes)


def _interpolated(values: Array, shift: float, weights_at: Weights) -> Array:
    samples = len(values)
    behind = int(np.ceil(shift))
    first, last = max(0, behind + 1), min(samples, samples - 2 + behind)
    if first >= last:
        return _one_by_one(values, np.arange(samples), shift, weights_at)
    # Between the edges all samples have the same weights: shifted copies, a sixth of the time.
    result = np.empty_like(values)
    inside, part = result[first:last], np.empty_like(values[first:last])
    for k, weight in enumerate(weights_at(np.array(behind - shift)), start=-1):
        source = values[first - behind + k : last - behind + k]
        np.multiply(source, weight, out=inside if k < 0 else part)
        if k >= 0:
            inside += part
    edges = np.r_[0:first, last:samples]
    result[edges] = _one_by_one(values, edges, shift, weights_at)
    return result


def _one_by_one(values: Array, rows: np.ndarray, shift: float, weights_at: Weights) -> Array:
    """Return some rows, each with weights of its own."""
    position = rows - shift
    base = np.clip(np.floor(position).astype(np.int64), 1, len(values) - 3)
    result = np.zeros((len(rows), values.shape[1]))
    for k, weight in enumerate(weights_at(position - base), start=-1):
        result += weight[:, None] * values[base + k]
    return result


def _cubics(s: Array) -> tuple[Array, Array, Array, Array]:
    """Return Lagrange's cubic polynomials for samples at -1, 0, 1 and 2."""
    return (
        -s * (s - 1.0) * (s - 2.0) / 6.0,
        (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
        -(s + 1.0) * s * (s - 2.0) / 2.0,
        (s + 1.0) * s * (s - 1.0) / 6.0,
    )


def _slopes(s: Array) -> tuple[Array, Array, Array, Array]:
    """Return their derivatives by the delay, which moves s backwards."""
    return (
        (3.0 * s * s - 6.0 * s + 2.0) / 6.0,
        -(3.0 * s * s - 4.0 * s - 1.0) / 2.0,
        (3.0 * s * s - 2.0 * s - 2.0) / 2.0,
        -(3.0 * s * s - 1.0) / 6.0,
    )
