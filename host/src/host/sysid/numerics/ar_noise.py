"""Autoregressive models of output noise: whitening, estimation, choice of the order.

The noise of an output is e[k] = a1 e[k-1] + ... + ap e[k-p] + w[k] with white innovations w
(EQUATIONS.md, eq. 27).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from host.arrays import Array

POLE_LIMIT = 0.999  # radius: nearer to one, 2000 samples cannot separate noise from drift
MOST_REFLECTED = 1.0 - 1e-9  # reflection coefficient: of a stable process rounding makes it one
HIGHEST_ORDER = 6  # of a noise model
SHRINKING, MOST_SHRINKINGS = 0.995, 200  # of the radius of poles


@dataclass(frozen=True, slots=True)
class ArNoise:
    """AR model of the noise of one output.

    Attributes
    ----------
    coefficient : Array, shape (order,)
        a1 to ap.
    start_whitener : Array, shape (order, order)
        Inverse Cholesky factor of the covariance of `order` successive samples in units of the
        innovation variance; it whitens the first samples exactly.
    """

    coefficient: Array
    start_whitener: Array

    @classmethod
    def from_coefficient(cls, coefficient: Array) -> ArNoise:
        """Return the model of stationary AR coefficients."""
        return cls(coefficient, _start_whitener(coefficient))

    @classmethod
    def white(cls) -> ArNoise:
        """Return the model of white noise."""
        return cls(np.zeros(0), np.zeros((0, 0)))

    @property
    def order(self) -> int:
        """Number of coefficients."""
        return len(self.coefficient)

    def whiten(self, values: Array) -> Array:
        """Return the innovations of columns, both of shape (samples, columns)."""
        if self.order == 0:
            return values
        return ar_filter(np.ascontiguousarray(values), self.coefficient, self.start_whitener)

    def log_determinant(self) -> float:
        """Return the log determinant of a record's noise covariance, innovation variance one."""
        if self.order == 0:
            return 0.0
        return float(-2.0 * np.sum(np.log(np.diag(self.start_whitener))))


def autocovariance(coefficient: Array, lags: int) -> Array:
    """Return the autocovariance of an AR process of unit innovation variance, (lags + 1,).

    By the Levinson-Durbin recursion (Kay, Modern Spectral Estimation, ch. 6), down to the
    reflection coefficients and up again. With these within one it is positive definite whatever
    rounding does: of poles next to one the Yule-Walker equations give a negative variance.

    Parameters
    ----------
    coefficient : Array, shape (order,)
    lags : int
    """
    order = len(coefficient)
    reflection, predictor = np.zeros(order), np.asarray(coefficient, dtype=np.float64)
    for last in range(order - 1, -1, -1):
        reflection[last] = np.clip(predictor[last], -MOST_REFLECTED, MOST_REFLECTED)
        predictor = predictor[:last] + reflection[last] * predictor[:last][::-1]
        predictor /= 1.0 - reflection[last] ** 2
    innovation = 1.0 / np.prod(1.0 - reflection**2)
    result = np.zeros(max(lags, order) + 1)
    result[0], predictor = innovation, np.zeros(0)
    for lag, reflected in enumerate(reflection, start=1):
        result[lag] = reflected * innovation + predictor @ result[1:lag][::-1]
        predictor = np.append(predictor - reflected * predictor[::-1], reflected)
        innovation *= 1.0 - reflected**2
    for lag in range(order + 1, lags + 1):
        result[lag] = predictor @ result[lag - order : lag][::-1]
    return result[: lags + 1]


def ar_filter(values: Array, coefficient: Array, start_whitener: Array) -> Array:
    """Whiten columns by an AR filter, w[k] = v[k] - sum a_l v[k-l].

    Parameters
    ----------
    values : Array, shape (samples, columns)
    coefficient : Array, shape (order,)
    head : Array, shape (order, order)
        See `ArNoise`: it makes the whitening exact from the first sample.

    Notes
    -----
    `scipy.signal.lfilter` filters from rest; its import takes 1.0 s where an answer takes 3.0.
    """
    order = len(coefficient)
    first = min(order, len(values))
    out = values.astype(np.float64)
    out[:first] = start_whitener[:first, :first] @ values[:first]
    for lag, part in enumerate(coefficient, start=1):
        out[order:] -= part * values[order - lag : len(values) - lag]
    return out


def _start_whitener(coefficient: Array) -> Array:
    order = len(coefficient)
    if order == 0:
        return np.zeros((0, 0))
    shrunk = coefficient.copy()
    for _ in range(MOST_SHRINKINGS):
        try:
            covariance = linalg.toeplitz(autocovariance(shrunk, order - 1))
            lower = np.linalg.cholesky(covariance)
            break
        except np.linalg.LinAlgError:
            # Residuals of a clean record are smooth: poles so near to one that rounding rules.
            shrunk *= SHRINKING ** np.arange(1, order + 1)
    else:
        return np.eye(order)
    return np.ascontiguousarray(linalg.solve_triangular(lower, np.eye(order), lower=True))


def stabilise(coefficient: Array) -> Array:
    """Return AR coefficients whose poles are shrunk into a circle of radius `POLE_LIMIT`."""
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
    # With both lags one larger the sum gains one sample at its start and loses one at its end.
    edges = np.vstack([columns[:order][::-1], columns[samples - order :][::-1]])
    products = edges @ edges.T
    for a in range(order):
        for b in range(a, order):
            edge = products[a, b] - products[order + a, order + b]
            result[a + 1, b + 1] = result[a, b] + edge
    return np.triu(result) + np.triu(result, 1).T


def lagged_moments(
    residuals: Sequence[Array], parameter_parts: Sequence[Array], order: int
) -> Array:
    """Return expected sums of e[k-a] e[k-b] of the noise, for a, b = 0..order.

    Residuals of a fit are smaller and whiter than the noise, because the parameters fit part of it.
    Their expected part J Cov J' is added here, so that `fit_ar` gives the restricted
    maximum-likelihood estimate by expectation-maximisation.

    Parameters
    ----------
    residuals : sequence of Array, shape (samples,)
        One output in each maneuver.
    parameter_parts : sequence of Array, shape (samples, P)
        J L with sensitivities J and L L' the covariance of the parameters.
    order : int
        Highest lag.
    """
    total = np.zeros((order + 1, order + 1))
    for residual, part in zip(residuals, parameter_parts, strict=True):
        total += _moments(np.ascontiguousarray(np.hstack([residual[:, None], part])), order)
    return total


def fit_ar(moments: Array, order: int) -> tuple[Array, float]:
    """Return AR coefficients and the sum of squared innovations from lagged moments.

    The coefficients solve the normal equations (Yule-Walker equations of the moments). They are
    singular for a residual that is rounding alone, or a straight line: it counts as white.
    """
    if order == 0:
        return np.zeros(0), float(moments[0, 0])
    block = moments[1 : order + 1, 1 : order + 1]
    right = moments[1 : order + 1, 0]
    try:
        coefficient = stabilise(np.linalg.solve(block, right))
    except np.linalg.LinAlgError:
        return np.zeros(order), float(moments[0, 0])
    innovation = float(
        moments[0, 0] - 2.0 * coefficient @ right + coefficient @ block @ coefficient
    )
    return coefficient, innovation


def choose_order(moments: Array, samples: int, *, criterion: str = "bic") -> int:
    """Return the AR order of least BIC or AICc, from moments up to the highest order considered.

    Ljung, System Identification, 2nd ed., ch. 16.

    Parameters
    ----------
    moments : Array, shape (highest + 1, highest + 1)
        See `lagged_moments`.
    samples : int
        Samples in each sum.
    criterion : str
        ``bic`` or ``aicc``.
    """
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
