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
from host.sysid.numerics.output_error_problem import OutputProblem, Response


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
        1 where nothing is larger. White, J' R J / (J' J)^2 of each output (Morelli & Klein 1997).
    """
    total = np.diag(problem.prior_precision)
    score = total.copy()
    for number, (response, m) in enumerate(zip(responses, problem.maneuvers, strict=True)):
        own, block = problem.columns(number), block_length(m.dt_s)
        left = block_means((problem.measured(number) - response.y).T, block)
        for j, (name, memory) in enumerate(zip(problem.model.outputs, noise, strict=True)):
            scale = np.sqrt(variance[j])
            J = memory.whiten(block_means(response.sensitivities[j], block)) / scale
            information = J.T @ J
            total[np.ix_(own, own)] += information
            if name in larger:
                residual = memory.whiten(left[:, [j]])[:, 0] / scale
                information = coloured_score_covariance(residual, J)
            score[np.ix_(own, own)] += information
    inverse = covariance_from_information(total)
    return np.asarray(np.diag(inverse @ score @ inverse) / np.maximum(np.diag(inverse), 1e-300))
