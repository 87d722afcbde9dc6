"""Variance of an estimate in noise that is not the one its fit counts on.

Output error weighs residuals by the noise that it counts on. In other noise its score has another
covariance, and each parameter as much more variance as the residual has more power where that
parameter shows: a residual that is slow widens what rests on slow motion, and little else.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from host.arrays import Array
from host.sysid.numerics.ar_noise import ArNoise, autocovariance
from host.sysid.numerics.coloured_residuals import (
    coloured_score_covariance,
    correlated_score_covariance,
)
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.input_coherence import block_length, block_means
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import Response

LONGEST_LAG = 200  # of an autocorrelation that counts, means
# Of a noise's power over that of what is left: more has a record without noise alone.
MOST_POWER = 4.0


def white_fit_variance(
    problem: OutputProblem,
    responses: Sequence[Response],
    noise: Sequence[ArNoise],
    innovation_variance: Array,
) -> Array:
    """Return the variance of each parameter of white output error in noise with a memory.

    M^-1 (sum S' R S + P) M^-1 with R of the noise, not of the residuals: these lack what the
    parameters took, slow gusts most (M_q of two maneuvers in 0.5 m/s: 38 of 50 intervals held).
    A gust moves all outputs, so that their innovations go together: it counts between outputs too.

    Parameters
    ----------
    problem : OutputProblem
    responses : sequence of Response
        At the estimate.
    noise : sequence of ArNoise
        Of the block means of each output, by restricted likelihood.
    innovation_variance : Array, shape (p,)

    Returns
    -------
    Array, shape (P,)
    """
    residuals = [problem.residual(k, r.y) for k, r in enumerate(responses)]
    squares = np.sum([np.sum(r**2, axis=1) for r in residuals], axis=0)
    variance = np.maximum(squares / problem.counts, problem.least_variance)
    total = np.diag(problem.prior_precision)
    score = total.copy()
    together = _correlation(problem, residuals, noise)
    for number, (response, m) in enumerate(zip(responses, problem.maneuvers, strict=True)):
        own, block = problem.columns(number), block_length(m.dt_s)
        moved: list[Array] = []  # weighed slopes by the innovations of each output
        for j, memory in enumerate(noise):
            seen = problem.seen(number, j)
            J = block_means(response.sensitivities[j], block, seen)
            # Samples that one mean stands for, in units of their variance.
            weight = (m.samples if seen is None else int(seen.sum())) / len(J) / variance[j]
            lags = min(len(J) - 1, LONGEST_LAG)
            R = innovation_variance[j] * autocovariance(memory.coefficient, lags)[: lags + 1]
            capped = min(1.0, MOST_POWER * variance[j] / R[0])
            total[np.ix_(own, own)] += weight * J.T @ J
            score[np.ix_(own, own)] += weight**2 * correlated_score_covariance(capped * R, J)
            size = weight * np.sqrt(capped * innovation_variance[j])
            moved.append(size * _by_innovations(memory.coefficient, J))
        for j, first in enumerate(moved):
            for k, second in enumerate(moved[:j]):
                both = together[j, k] * first.T @ second
                score[np.ix_(own, own)] += both + both.T
    inverse = covariance_from_information(total)
    return np.asarray(np.diag(inverse @ score @ inverse))


def _correlation(
    problem: OutputProblem, residuals: Sequence[Array], noise: Sequence[ArNoise]
) -> Array:
    """Return how the innovations of the outputs go together, (p, p)."""
    found = []
    for j, memory in enumerate(noise):
        white = [
            memory.whiten(
                block_means(r[j][:, None], block_length(m.dt_s), problem.seen(number, j))
            )[:, 0]
            for number, (r, m) in enumerate(zip(residuals, problem.maneuvers, strict=True))
        ]
        found.append(np.concatenate(white))
    size = np.sqrt(np.maximum([float(e @ e) for e in found], 1e-300))
    return np.asarray(np.array(found) @ np.array(found).T / np.outer(size, size))


def _by_innovations(coefficient: Array, slopes: Array) -> Array:
    """Return G with S' n = G' e, of an autoregressive noise n and its innovations e."""
    result = slopes.copy()
    for t in range(len(slopes) - 2, -1, -1):
        for lag, part in enumerate(coefficient[: len(slopes) - 1 - t], start=1):
            result[t] += part * result[t + lag]
    return result


def variance_ratio(
    problem: OutputProblem,
    responses: Sequence[Response],
    noise: Sequence[ArNoise],
    variance: Array,
    larger: Collection[str],
) -> Array:
    """Return the variance of each parameter in the residuals over that in the noise counted on.

    Parameters
    ----------
    problem : OutputProblem
    responses : sequence of Response
        At the estimate.
    noise : sequence of ArNoise
        Counted on, of the block means of each output.
    variance : Array, shape (p,)
        Of their innovations.
    larger : collection of str
        Outputs whose residuals count as they are; the others are taken for the noise counted on.

    Returns
    -------
    Array, shape (P,)
        1 where nothing is larger. White, J' R J / (J' J)^2 of each output (EQUATIONS.md, eq. 34).
    """
    total = np.diag(problem.prior_precision)
    score = total.copy()
    for number, (response, m) in enumerate(zip(responses, problem.maneuvers, strict=True)):
        own, block = problem.columns(number), block_length(m.dt_s)
        left = block_means(problem.residual(number, response.y).T, block, m.sampled)
        for j, (name, memory) in enumerate(zip(problem.model.outputs, noise, strict=True)):
            scale, seen = np.sqrt(variance[j]), problem.seen(number, j)
            J = memory.whiten(block_means(response.sensitivities[j], block, seen)) / scale
            information = J.T @ J
            total[np.ix_(own, own)] += information
            if name in larger:
                residual = memory.whiten(left[:, [j]])[:, 0] / scale
                information = coloured_score_covariance(residual, J)
            score[np.ix_(own, own)] += information
    inverse = covariance_from_information(total)
    return np.asarray(np.diag(inverse @ score @ inverse) / np.maximum(np.diag(inverse), 1e-300))
