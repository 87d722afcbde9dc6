"""Output error with intervals that cover: residual memory is estimated, whitened and refitted.

The standard correction (Morelli & Klein 1997) keeps the white fit and repairs its covariance from
raw residual autocorrelations; those are biased low, so it covers 87-90 %. Here instead

1. residuals of each output get an autoregressive model, order by BIC, from moments to which the
   share eaten by the fit is given back (`noise`): restricted maximum likelihood;
2. output error is refitted with the whitened likelihood, which is also the efficient estimate, so
   that the interval is near the bound for known noise and not only honest;
3. the uncertainty of the noise model itself goes into the interval: a t quantile whose degrees of
   freedom follow Satterthwaite from the information of the noise parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.estimators.multistart import multistart
from host.sysid.numerics.ar_noise import ArNoise, choose_order, fit_ar, lagged_moments
from host.sysid.numerics.output_error import (
    Optimum,
    covariance_of_free,
    minimise,
    whitened_sensitivities,
)
from host.sysid.numerics.output_error_problem import OutputProblem

HIGHEST_ORDER = 6
REFITS = 4
COEFFICIENT_CHANGE = 1e-3
MOMENT_ROUNDS = 6
SMALLEST_DOF = 3.0


@dataclass(frozen=True)
class ArNoiseFit:
    """A fit whose covariance and degrees of freedom belong to its estimated noise model."""

    optimum: Optimum
    covariance: Array
    covariance_white: Array
    degrees_of_freedom: Array
    noise: tuple[ArNoise, ...]
    innovation_variance: Array
    refits: int


def fit_with_ar_noise(
    problem: OutputProblem,
    theta: Array,
    *,
    highest_order: int = HIGHEST_ORDER,
    criterion: str = "bic",
    multiple_starts: bool = True,
) -> ArNoiseFit:
    """Fit output error and the memory of its noise together.

    Parameters
    ----------
    problem : OutputProblem
        Model and data.
    theta : Array, shape (P,)
        Start.
    highest_order : int
        Highest AR order considered; 0 keeps the noise white.
    criterion : str
        ``bic`` or ``aicc``.
    multiple_starts : bool
        See `multistart`.
    """
    optimum = multistart(problem, theta, multiple_starts=multiple_starts)
    outputs = len(problem.model.outputs)
    noise = [ArNoise.white() for _ in range(outputs)]
    variance = _innovation_variances(problem, optimum, noise, optimum.variance)
    covariance_white = _covariance(problem, optimum, noise, variance)
    orders: list[int] | None = None
    refits = 0
    if highest_order > 0:
        while refits < REFITS:
            refits += 1
            before = [n.coefficient for n in noise]
            noise, variance, orders = _fit_ar_models(
                problem, optimum, noise, variance, highest_order, criterion, orders
            )
            if all(n.order == 0 for n in noise):
                break
            optimum = minimise(problem, optimum.theta, noise=noise)
            change = max(
                float(np.max(np.abs(n.coefficient - b), initial=0.0)) if len(b) == n.order else 1.0
                for n, b in zip(noise, before, strict=True)
            )
            if change < COEFFICIENT_CHANGE:
                break
    variance = _innovation_variances(problem, optimum, noise, variance)
    covariance = _covariance(problem, optimum, noise, variance)
    dof = _satterthwaite(problem, optimum, noise, variance, covariance)
    return ArNoiseFit(optimum, covariance, covariance_white, dof, tuple(noise), variance, refits)


def _information(
    problem: OutputProblem, optimum: Optimum, noise: Sequence[ArNoise], variance: Array
) -> tuple[Array, list[Array]]:
    """Return the information matrix and the whitened slopes."""
    slopes = whitened_sensitivities(problem, optimum.responses, noise)
    information = np.diag(problem.prior_precision)
    for number, block in enumerate(slopes):
        columns = problem.columns(number)
        part = np.zeros((len(columns), len(columns)))
        for j in range(len(block)):
            part += (block[j].T @ block[j]) / variance[j]
        information[np.ix_(columns, columns)] += part
    return information, slopes


def _covariance(
    problem: OutputProblem, optimum: Optimum, noise: Sequence[ArNoise], variance: Array
) -> Array:
    information, _ = _information(problem, optimum, noise, variance)
    return covariance_of_free(information, optimum.free)


def _innovation_variances(
    problem: OutputProblem, optimum: Optimum, noise: Sequence[ArNoise], variance: Array
) -> Array:
    """Return unbiased innovation variances: each output's share of the parameters is counted."""
    for _ in range(3):
        information, slopes = _information(problem, optimum, noise, variance)
        covariance = covariance_of_free(information, optimum.free)
        fresh = np.zeros(len(noise))
        for j, memory in enumerate(noise):
            squares, share = 0.0, 0.0
            for number, block in enumerate(slopes):
                columns = problem.columns(number)
                local = covariance[np.ix_(columns, columns)]
                share += float(np.sum((block[j].T @ block[j]) * local)) / variance[j]
                white = memory.whiten(optimum.residuals[number][j][:, None])
                squares += float(np.sum(white**2))
            fresh[j] = squares / max(problem.samples - share, 1.0)
        settled = bool(np.all(np.abs(fresh - variance) < 1e-6 * fresh))
        variance = np.maximum(fresh, 1e-300)
        if settled:
            break
    return variance


def _fit_ar_models(
    problem: OutputProblem,
    optimum: Optimum,
    noise: Sequence[ArNoise],
    variance: Array,
    highest: int,
    criterion: str,
    orders: list[int] | None,
) -> tuple[list[ArNoise], Array, list[int]]:
    """Estimate the AR model of each output by expectation-maximisation at a fixed fit."""
    chosen = list(orders) if orders is not None else [-1] * len(noise)
    memory = list(noise)
    for round_number in range(MOMENT_ROUNDS):
        information, _ = _information(problem, optimum, memory, variance)
        covariance = covariance_of_free(information, optimum.free)
        lower = _matrix_root(covariance)
        fresh, change = [], 0.0
        variance = variance.copy()
        for j in range(len(memory)):
            residuals = [r[j] for r in optimum.residuals]
            shares = [
                response.sensitivities[j] @ lower[problem.columns(number)]
                for number, response in enumerate(optimum.responses)
            ]
            top = highest if chosen[j] < 0 or round_number < 2 else chosen[j]
            moments = lagged_moments(residuals, shares, top)
            count = problem.samples - top * len(residuals)
            if orders is None and round_number < 2:
                chosen[j] = choose_order(moments, count, criterion=criterion)
            order = chosen[j]
            coefficient, innovation = fit_ar(moments[: order + 1, : order + 1], order)
            variance[j] = max(innovation / count, 1e-300)
            old = memory[j].coefficient
            if len(old) == order:
                change = max(change, float(np.max(np.abs(coefficient - old), initial=0.0)))
            else:
                change = np.inf
            fresh.append(ArNoise.from_coefficient(coefficient))
        memory = fresh
        if change < COEFFICIENT_CHANGE:
            break
    return memory, variance, chosen


def _matrix_root(covariance: Array) -> Array:
    value, vector = np.linalg.eigh(covariance)
    return np.asarray(vector * np.sqrt(np.maximum(value, 0.0)), dtype=np.float64)


def _satterthwaite(
    problem: OutputProblem,
    optimum: Optimum,
    noise: Sequence[ArNoise],
    variance: Array,
    covariance: Array,
) -> Array:
    """Return degrees of freedom per parameter: 2 / var(log of its variance).

    The log variance moves with log innovation variances (whose own variance is 2 / samples) and
    with the AR coefficients (asymptotic covariance R^-1 / samples, R the autocovariance matrix in
    units of the innovation); derivatives are central differences.
    """
    samples = problem.samples
    free = np.flatnonzero(np.diag(covariance) > 0.0)
    base = np.diag(covariance)[free]
    spread = np.zeros(len(free))
    blocks = _information_per_output(problem, optimum, noise)
    total = np.diag(problem.prior_precision) + sum(
        b / v for b, v in zip(blocks, variance, strict=True)
    )
    for j, memory in enumerate(noise):
        # d C = C (block_j / variance_j) C per unit of log variance
        slope = np.einsum(
            "ij,jk,ki->i", covariance[free], blocks[j] / variance[j], covariance[:, free]
        )
        spread += (slope / base) ** 2 * 2.0 / samples
        if memory.order == 0:
            continue
        scatter = np.linalg.inv(_toeplitz(memory)) / samples
        slopes = np.zeros((memory.order, len(free)))
        for k in range(memory.order):
            width = 0.1 * np.sqrt(scatter[k, k])
            change = np.zeros_like(total)
            for sign in (1.0, -1.0):
                moved = memory.coefficient.copy()
                moved[k] += sign * width
                # Interior of the record only: a moved coefficient need not be stationary.
                change += sign * _filtered_information(problem, optimum, j, moved)
            change /= 2.0 * width * variance[j]
            inner = -np.einsum("ij,jk,ki->i", covariance[free], change, covariance[:, free])
            slopes[k] = inner / base
        spread += np.einsum("ki,kl,li->i", slopes, scatter, slopes)
    dof = np.full(len(covariance), np.inf)
    dof[free] = np.maximum(2.0 / np.maximum(spread, 1e-12), SMALLEST_DOF)
    return dof


def _toeplitz(memory: ArNoise) -> Array:
    inverse = np.linalg.inv(memory.start_whitener)
    return np.asarray(inverse @ inverse.T, dtype=np.float64)


def _filtered_information(
    problem: OutputProblem, optimum: Optimum, output: int, coefficient: Array
) -> Array:
    """Return J'J of one output filtered by AR coefficients, whole vector, unit variance."""
    order = len(coefficient)
    result = np.zeros((len(problem.names), len(problem.names)))
    for number, response in enumerate(optimum.responses):
        columns = problem.columns(number)
        slope = response.sensitivities[output]
        white = slope[order:].copy()
        for k in range(order):
            white -= coefficient[k] * slope[order - 1 - k : len(slope) - 1 - k]
        result[np.ix_(columns, columns)] += white.T @ white
    return result


def _information_per_output(
    problem: OutputProblem, optimum: Optimum, noise: Sequence[ArNoise]
) -> list[Array]:
    result: list[Array] = []
    slopes = whitened_sensitivities(problem, optimum.responses, noise)
    for j in range(len(noise)):
        total = np.zeros((len(problem.names), len(problem.names)))
        for number, block in enumerate(slopes):
            columns = problem.columns(number)
            total[np.ix_(columns, columns)] += block[j].T @ block[j]
        result.append(total)
    return result
