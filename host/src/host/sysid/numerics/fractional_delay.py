"""Delay of sampled signals by a fraction of a sample (Lagrange interpolation)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from host.arrays import Array
from host.compiled import compiled_part

Weights = Callable[[Any], tuple[Any, Any, Any, Any]]  # of a number or of an array


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


@compiled_part
def delayed_at(values: Array, row: int, shift: float) -> tuple[float, float]:
    """Return one number of `delay_columns` and of `slope_by_delay`, of one column (samples,)."""
    position = row - shift
    base = min(max(int(np.floor(position)), 1), len(values) - 3)
    before, here, ahead, beyond = _cubics(position - base)
    d_before, d_here, d_ahead, d_beyond = _slopes(position - base)
    a, b, c, d = values[base - 1], values[base], values[base + 1], values[base + 2]
    value = before * a + here * b + ahead * c + beyond * d
    return value, d_before * a + d_here * b + d_ahead * c + d_beyond * d


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


@compiled_part
def _cubics(s: Any) -> tuple[Any, Any, Any, Any]:
    """Return Lagrange's cubic polynomials for samples at -1, 0, 1 and 2."""
    return (
        -s * (s - 1.0) * (s - 2.0) / 6.0,
        (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
        -(s + 1.0) * s * (s - 2.0) / 2.0,
        (s + 1.0) * s * (s - 1.0) / 6.0,
    )


@compiled_part
def _slopes(s: Any) -> tuple[Any, Any, Any, Any]:
    """Return their derivatives by the delay, which moves s backwards."""
    return (
        (3.0 * s * s - 6.0 * s + 2.0) / 6.0,
        -(3.0 * s * s - 4.0 * s - 1.0) / 2.0,
        (3.0 * s * s - 2.0 * s - 2.0) / 2.0,
        -(3.0 * s * s - 1.0) / 6.0,
    )
