"""Output error with autoregressive residuals, whose intervals cover.

The standard correction (Morelli & Klein 1997) keeps the fit for white noise and corrects its
covariance by sample autocorrelations of the residuals. Those are biased low: it covers 87-90 %.
Here

1. the noise of each output gets an AR model, its order by BIC, estimated by restricted maximum
   likelihood (`ar_noise.lagged_moments`);
2. output error is fitted again with the whitened likelihood, which gives the efficient estimate and
   an interval near the Cramer-Rao bound of known noise;
3. where the inputs drive the residual, the noise is estimated without what they drive, and the fit
   repeated (`refit_without_driven`): noise may not explain what the model lacks;
4. the uncertainty of the noise model widens the interval by a t quantile, its degrees of freedom
   after Satterthwaite.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray
from host.sysid.estimators.multistart import multistart
from host.sysid.models.uncertainty import covariance_root
from host.sysid.numerics.ar_noise import (
    HIGHEST_ORDER,
    ArNoise,
    choose_order,
    fit_ar,
    lagged_moments,
)
from host.sysid.numerics.between_samples import left_between_samples
from host.sysid.numerics.input_coherence import InputCoherence, input_coherence
from host.sysid.numerics.output_error import (
    Optimum,
    covariance_of_free,
    minimise,
    whitened_sensitivities,
)
from host.sysid.numerics.output_error_problem import OutputProblem

REFITS = 4
COEFFICIENT_CHANGE = 1e-3
MOMENT_ROUNDS = 6
SMALLEST_DOF = 3.0


@dataclass(frozen=True)
class ArNoiseFit:
    """A fit whose covariance and degrees of freedom belong to its estimated AR noise models."""

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
    restarts: bool = True,
) -> ArNoiseFit:
    """Fit output error and the AR models of its noise together.

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
    multiple_starts, restarts : bool
        See `multistart`.
    """
    optimum = multistart(problem, theta, multiple_starts=multiple_starts, restarts=restarts)
    outputs = len(problem.model.outputs)
    noise = [ArNoise.white() for _ in range(outputs)]
    variance = _innovation_variances(problem, optimum, noise, optimum.variance)
    covariance_white = _covariance(problem, optimum, noise, variance)
    orders: list[int] | None = None
    refits = 0
    if highest_order > 0:
        clean = left_between_samples(problem, optimum.theta, optimum.responses)
        while refits < REFITS:
            refits += 1
            before = [n.coefficient for n in noise]
            noise, variance, orders = _fit_ar_models(
                problem, optimum, noise, variance, highest_order, criterion, orders, clean
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


def refit_without_driven(
    problem: OutputProblem, fit: ArNoiseFit, *, highest_order: int = HIGHEST_ORDER
) -> tuple[ArNoiseFit, InputCoherence]:
    """Fit again where the noise explained what the inputs drive; return also how they are coherent.

    The noise of a fit whose residual is coherent with the inputs is estimated without what
    they drive. With it the model's error weighs what it weighs, and is not whitened away.

    Parameters
    ----------
    problem : OutputProblem
    fit : ArNoiseFit
    highest_order : int
        Highest order of the AR models.
    """
    found = input_coherence(problem, fit.optimum.responses, fit.optimum.theta)
    if not found.coherent or all(n.order == 0 for n in fit.noise):
        return fit, found
    coherence = input_coherence(
        problem, fit.optimum.responses, fit.optimum.theta, highest_order=highest_order, block_s=0.0
    )
    known = np.isfinite(problem.known_variance)  # known noise is white
    noise = tuple(
        ArNoise.white() if fixed else n for n, fixed in zip(coherence.noise, known, strict=True)
    )
    optimum = minimise(problem, fit.optimum.theta, noise=noise)
    variance = _innovation_variances(problem, optimum, noise, coherence.innovation_variance)
    covariance = _covariance(problem, optimum, noise, variance)
    dof = _satterthwaite(problem, optimum, noise, variance, covariance)
    again = ArNoiseFit(
        optimum, covariance, fit.covariance_white, dof, noise, variance, fit.refits + 1
    )
    return again, input_coherence(problem, optimum.responses, optimum.theta)


def _information(
    problem: OutputProblem, optimum: Optimum, noise: Sequence[ArNoise], variance: Array
) -> tuple[Array, list[Array]]:
    """Return the information matrix and the whitened sensitivities."""
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
    return covariance_of_free(information, optimum.free, problem.names)


def _innovation_variances(
    problem: OutputProblem, optimum: Optimum, noise: Sequence[ArNoise], variance: Array
) -> Array:
    """Return unbiased innovation variances; each output loses its share of the parameters."""
    for _ in range(3):
        information, slopes = _information(problem, optimum, noise, variance)
        covariance = covariance_of_free(information, optimum.free, problem.names)
        updated = np.zeros(len(noise))
        for j, memory in enumerate(noise):
            squares, share = 0.0, 0.0
            for number, block in enumerate(slopes):
                columns = problem.columns(number)
                local = covariance[np.ix_(columns, columns)]
                share += float(np.sum((block[j].T @ block[j]) * local)) / variance[j]
                white = memory.whiten(optimum.residuals[number][j][:, None])
                squares += float(np.sum(white**2))
            updated[j] = squares / max(problem.counts[j] - share, 1.0)
        updated = np.where(np.isnan(problem.known_variance), updated, problem.known_variance)
        converged = bool(np.all(np.abs(updated - variance) < 1e-6 * updated))
        floor = np.where(np.isnan(problem.known_variance), problem.least_variance, 0.0)
        variance = np.maximum(updated, np.maximum(floor, 1e-300))
        if converged:
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
    clean: BoolArray,
) -> tuple[list[ArNoise], Array, list[int]]:
    """Estimate the AR model of each output by expectation-maximisation at a fixed fit.

    Those that are `clean` leave no noise.
    """
    clean = clean | np.isfinite(problem.known_variance)  # known noise is white
    selected = list(orders) if orders is not None else [-1] * len(noise)
    memory = list(noise)
    for round_number in range(MOMENT_ROUNDS):
        information, _ = _information(problem, optimum, memory, variance)
        covariance = covariance_of_free(information, optimum.free, problem.names)
        lower = covariance_root(covariance)
        updated, change = [], 0.0
        variance = variance.copy()
        for j in range(len(memory)):
            residuals = [r[j] for r in optimum.residuals]
            power = sum(float(e @ e) for e in residuals) / problem.counts[j]
            # What a clean column leaves is the input between its samples: smooth, and driven by the
            # least noise such a memory widens intervals to 70 000 %.
            if clean[j] or power <= problem.clean_variance[j]:
                selected[j] = 0
                updated.append(ArNoise.white())
                continue
            top = highest if selected[j] < 0 or round_number < 2 else selected[j]
            if problem.counts[j] < problem.samples:
                top = 0  # the memory between two values of a slow sensor is not seen
            moments = _moments(problem, optimum, lower, j, top)
            count = int(problem.counts[j]) - top * len(residuals)
            if orders is None and round_number < 2:
                selected[j] = choose_order(moments, count, criterion=criterion)
            order = selected[j]
            coefficient, innovation = fit_ar(moments[: order + 1, : order + 1], order)
            variance[j] = max(innovation / count, problem.least_variance[j], 1e-300)
            old = memory[j].coefficient
            if len(old) == order:
                change = max(change, float(np.max(np.abs(coefficient - old), initial=0.0)))
            else:
                change = np.inf
            updated.append(ArNoise.from_coefficient(coefficient))
        memory = updated
        if change < COEFFICIENT_CHANGE:
            break
    return memory, variance, selected


def _moments(problem: OutputProblem, optimum: Optimum, lower: Array, j: int, top: int) -> Array:
    """Return lagged moments of the errors of output `j`: residuals, and what the fit took of them.

    `lower` is a root of the covariance of the fit.
    """
    shares = [
        response.sensitivities[j] @ lower[problem.columns(number)]
        for number, response in enumerate(optimum.responses)
    ]
    return lagged_moments([r[j] for r in optimum.residuals], shares, top)


def _satterthwaite(
    problem: OutputProblem,
    optimum: Optimum,
    noise: Sequence[ArNoise],
    variance: Array,
    covariance: Array,
) -> Array:
    """Return degrees of freedom per parameter, 2 / var(log of its variance).

    Satterthwaite, Biometrics Bulletin 2 (1946). The log variance depends on log innovation
    variances (whose own variance is 2 / samples) and on the AR coefficients (asymptotic covariance
    R^-1 / samples, R the autocovariance matrix in units of the innovation); derivatives are central
    differences.
    """
    samples = problem.samples
    free = np.flatnonzero(np.diag(covariance) > 0.0)
    base = np.diag(covariance)[free]
    variance_of_log = np.zeros(len(free))
    blocks = _information_per_output(problem, optimum, noise)
    total = np.diag(problem.prior_precision) + sum(
        b / v for b, v in zip(blocks, variance, strict=True)
    )
    for j, memory in enumerate(noise):
        # d C = C (block_j / variance_j) C per unit of log variance
        slope = np.einsum(
            "ij,jk,ki->i", covariance[free], blocks[j] / variance[j], covariance[:, free]
        )
        if np.isnan(problem.known_variance[j]):
            variance_of_log += (slope / base) ** 2 * 2.0 / samples
        if memory.order == 0:
            continue
        scatter = np.linalg.inv(_toeplitz(memory)) / samples
        slopes = np.zeros((memory.order, len(free)))
        for k in range(memory.order):
            width = 0.1 * np.sqrt(scatter[k, k])
            change = np.zeros_like(total)
            for sign in (1.0, -1.0):
                shifted = memory.coefficient.copy()
                shifted[k] += sign * width
                # Interior of the record only: a shifted coefficient need not be stationary.
                change += sign * _filtered_information(problem, optimum, j, shifted)
            change /= 2.0 * width * variance[j]
            inner = -np.einsum("ij,jk,ki->i", covariance[free], change, covariance[:, free])
            slopes[k] = inner / base
        variance_of_log += np.einsum("ki,kl,li->i", slopes, scatter, slopes)
    dof = np.full(len(covariance), np.inf)
    dof[free] = np.maximum(2.0 / np.maximum(variance_of_log, 1e-12), SMALLEST_DOF)
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
