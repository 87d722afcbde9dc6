"""Variance of an estimate in noise that is not the one its fit counts on.

Output error weighs residuals by the noise that it counts on. In other noise its score has another
covariance, and each parameter as much more variance as the residual has more power where that
parameter shows: a residual that is slow widens what rests on slow motion, and little else.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from host.arrays import Array
from host.sysid.numerics.ar_noise import ArNoise
from host.sysid.numerics.coloured_residuals import coloured_score_covariance
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.input_coherence import block_length, block_means
from host.sysid.numerics.joint_noise import JointNoise
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import Response

# Most of a noise's power over that of what is left: more has a record without noise alone. In side
# gusts of 0.3 m/s a fit leaves half of it in r, two thirds in beta; beyond 3 no interval moves
# there.
MOST_POWER = 3.0


def white_fit_covariance(
    problem: OutputProblem, responses: Sequence[Response], noise: JointNoise
) -> Array:
    """Return the covariance of white output error in noise with a memory.

    M^-1 (sum S' R S + P) M^-1 with R of the noise, not of the residuals: these lack what the
    parameters took, slow gusts most (M_q of two maneuvers in 0.5 m/s: 38 of 50 intervals hold).

    Parameters
    ----------
    problem : OutputProblem
    responses : sequence of Response
        At the estimate.
    noise : JointNoise
        Noise of the block means of all outputs.

    Returns
    -------
    Array, shape (P, P)
    """
    residuals = [problem.residual(k, r.y) for k, r in enumerate(responses)]
    squares = np.sum([np.sum(r**2, axis=1) for r in residuals], axis=0)
    variance = np.maximum(squares / problem.counts, problem.least_variance)
    total = np.diag(problem.prior_precision)
    scores = [np.diag(np.sqrt(problem.prior_precision))]
    for number, (response, m) in enumerate(zip(responses, problem.maneuvers, strict=True)):
        own, block = problem.columns(number), block_length(m.dt_s)
        weighed = []
        for j, slopes in enumerate(response.sensitivities):
            seen = problem.seen(number, j)
            J = block_means(slopes, block, seen)
            # Samples that one mean stands for, in units of their variance.
            weight = (m.samples if seen is None else int(seen.sum())) / len(J) / variance[j]
            total[np.ix_(own, own)] += weight * J.T @ J
            weighed.append(weight * J)
        capped = np.minimum(1.0, MOST_POWER * variance / noise.power(2 * len(weighed[0])))
        moved = noise.by_innovations(np.stack(weighed, axis=1) * np.sqrt(capped)[:, None]).reshape(
            -1, len(own)
        )
        scores.append(np.zeros((len(moved), len(total))))
        scores[-1][:, own] = moved
    # By its root: a direction without information is 1e8 times as long as others.
    root = np.concatenate(scores) @ covariance_from_information(total)
    return np.asarray(root.T @ root)


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
        Variance of their innovations.
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
