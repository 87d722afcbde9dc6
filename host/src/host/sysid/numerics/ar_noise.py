"""Autoregressive models of output noise: whitening, estimation with correction, order choice.

e[k] = a1 e[k-1] + ... + ap e[k-p] + w[k]. Residuals of a fit are smaller and whiter than the noise,
because the parameters have eaten their share; the moments below give it back (J Cov J' is what the
fit took), which makes the estimate restricted maximum likelihood by expectation-maximisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from host.arrays import Array

POLE_LIMIT = 0.999  # radius: closer to one, a 2000-sample record cannot tell noise from drift


@dataclass(frozen=True, slots=True)
class ArNoise:
    """AR coefficients of one output and the filter that whitens its first samples."""

    coefficient: Array
    head: Array

    @classmethod
    def from_coefficient(cls, coefficient: Array) -> ArNoise:
        """Prepare the exact start of the whitening for stationary AR coefficients."""
        return cls(coefficient, _head(coefficient))

    @classmethod
    def white(cls) -> ArNoise:
        """Return the model without memory."""
        return cls(np.zeros(0), np.zeros((0, 0)))

    @property
    def order(self) -> int:
        """Number of coefficients."""
        return len(self.coefficient)

    def whiten(self, values: Array) -> Array:
        """Filter columns (samples, columns) to unit-memory innovations."""
        if self.order == 0:
            return values
        return ar_filter(np.ascontiguousarray(values), self.coefficient, self.head)

    def log_determinant(self) -> float:
        """Log determinant of the noise covariance of a record, innovation variance one."""
        if self.order == 0:
            return 0.0
        return float(-2.0 * np.sum(np.log(np.diag(self.head))))


def autocovariance(coefficient: Array, lags: int) -> Array:
    """Return the autocovariance of an AR process of unit innovation, lags 0 to `lags`."""
    order = len(coefficient)
    if order == 0:
        return np.concatenate([[1.0], np.zeros(lags)])
    equations = np.zeros((order + 1, order + 1))
    for lag in range(order + 1):
        equations[lag, lag] += 1.0
        for k in range(1, order + 1):
            equations[lag, abs(lag - k)] -= coefficient[k - 1]
    right = np.zeros(order + 1)
    right[0] = 1.0
    start = np.linalg.solve(equations, right)
    result = np.zeros(max(lags, order) + 1)
    result[: order + 1] = start
    for lag in range(order + 1, lags + 1):
        result[lag] = coefficient @ result[lag - order : lag][::-1]
    return result[: lags + 1]


def ar_filter(values: Array, coefficient: Array, head: Array) -> Array:
    """Whiten columns by an AR filter: e[k] = v[k] - sum a_l v[k-l], first samples by `head`.

    Parameters
    ----------
    values : Array, shape (samples, columns)
    coefficient : Array, shape (order,)
    head : Array, shape (order, order)
        Inverse Cholesky factor of the covariance of `order` successive samples in units of the
        innovation, which makes the whitening exact from the first sample.

    Notes
    -----
    `scipy.signal.lfilter` filters from rest; its import takes 1.0 s where an answer takes 3.0.
    """
    order = len(coefficient)
    first = min(order, len(values))
    out = values.astype(np.float64)
    out[:first] = head[:first, :first] @ values[:first]
    for lag, share in enumerate(coefficient, start=1):
        out[order:] -= share * values[order - lag : len(values) - lag]
    return out


def _head(coefficient: Array) -> Array:
    order = len(coefficient)
    if order == 0:
        return np.zeros((0, 0))
    covariance = linalg.toeplitz(autocovariance(coefficient, order - 1))
    lower = np.linalg.cholesky(covariance)
    return np.ascontiguousarray(linalg.solve_triangular(lower, np.eye(order), lower=True))


def stabilise(coefficient: Array) -> Array:
    """Pull the poles of an AR model inside `POLE_LIMIT`."""
    if len(coefficient) == 0:
        return coefficient
    radius = float(np.max(np.abs(np.roots(np.concatenate([[1.0], -coefficient])))))
    if radius <= POLE_LIMIT:
        return coefficient
    shrink = (POLE_LIMIT / radius) ** np.arange(1, len(coefficient) + 1)
    return coefficient * shrink


def _moments(columns: Array, order: int) -> Array:
    """Return sums over k >= order of columns[k - a] . columns[k - b], for a, b = 0..order."""
    samples = len(columns)
    result = np.zeros((order + 1, order + 1))
    if samples <= order:
        return result
    for b in range(order + 1):
        result[0, b] = np.vdot(columns[order:], columns[order - b : samples - b])
    # One lag further on both sides the same sum has one sample more in front, one less behind.
    edges = np.vstack([columns[:order][::-1], columns[samples - order :][::-1]])
    products = edges @ edges.T
    for a in range(order):
        for b in range(a, order):
            edge = products[a, b] - products[order + a, order + b]
            result[a + 1, b + 1] = result[a, b] + edge
    return np.triu(result) + np.triu(result, 1).T


def lagged_moments(residuals: Sequence[Array], taken: Sequence[Array], order: int) -> Array:
    """Return sums of e[k-a] e[k-b], expected given the fit, for a, b = 0..order.

    Parameters
    ----------
    residuals : sequence of Array, shape (samples,)
        One output in each maneuver.
    taken : sequence of Array, shape (samples, P)
        J L with L L' the covariance of the parameters: what the fit took out of the noise.
    order : int
        Highest lag.
    """
    total = np.zeros((order + 1, order + 1))
    for residual, share in zip(residuals, taken, strict=True):
        total += _moments(np.ascontiguousarray(np.hstack([residual[:, None], share])), order)
    return total


def fit_ar(moments: Array, order: int) -> tuple[Array, float]:
    """Return AR coefficients and innovation sum of squares from lagged moments."""
    if order == 0:
        return np.zeros(0), float(moments[0, 0])
    block = moments[1 : order + 1, 1 : order + 1]
    right = moments[1 : order + 1, 0]
    coefficient = stabilise(np.linalg.solve(block, right))
    innovation = float(
        moments[0, 0] - 2.0 * coefficient @ right + coefficient @ block @ coefficient
    )
    return coefficient, innovation


def choose_order(moments: Array, samples: int, *, criterion: str = "bic") -> int:
    """Choose the AR order by BIC or AICc from moments up to the highest order considered."""
    highest = len(moments) - 1
    scores = []
    for order in range(highest + 1):
        _, innovation = fit_ar(moments, order)
        free = order + 1
        fit = samples * np.log(max(innovation, 1e-300) / samples)
        if criterion == "bic":
            penalty = free * np.log(samples)
        else:
            penalty = 2.0 * free * samples / max(samples - free - 1, 1)
        scores.append(fit + penalty)
    return int(np.argmin(scores))
