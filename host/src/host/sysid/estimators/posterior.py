"""Refusal near its limit: the fit is repeated with fresh noise, and each answer judged by its own.

Where a bound comes near its value, estimates are not normal any more and the bound at the estimate
is not the bound at the truth: of an estimate five bounds off it is a third or four times as large.
So a fit whose refusal is not clear is fitted again and again to its data with as much noise added
as they hold, a prior drawn with it: randomised maximum likelihood, a draw from the posterior
exactly where outputs are linear in the parameters and nearly so elsewhere (Oliver, He & Reynolds,
5th European Conference on the Mathematics of Oil Recovery, 1996; Bardsley, Solonen, Haario & Laine,
SIAM Journal on Scientific Computing 36, 2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError
from host.sysid.models.diagnostics import Draws, exceedance, prior_deviation, regressor_rms
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.result import FitResult
from host.sysid.numerics.noise import OutputNoise
from host.sysid.numerics.output_error import covariance_of, minimise
from host.sysid.numerics.problem import OutputProblem

UNCLEAR = (0.01, 0.99)  # probability of refusal by the normal distribution: between, look closer
DRAWS = 100
ROUGH = 0.1  # Cramer-Rao bounds: a draw need not be known better
STEPS = 25
MOST_SLOPES = 500_000  # samples times outputs times parameters: above, this takes many seconds
SAME = 0.05  # of a standard error: further from the likelihood's own, the covariance is another's
SEED = 1


def closer_look(result: FitResult, maneuvers: Sequence[Maneuver]) -> Draws | None:
    """Return what `judge` should look at: draws where the normal distribution is not sure.

    Parameters
    ----------
    result : FitResult
        Of any method; draws are for output error with its own covariance.
    maneuvers : sequence of Maneuver
        What it was fitted to.

    Returns
    -------
    Draws or None
        None where the normal distribution is sure, or no draws can be had.
    """
    _, refused = exceedance(result, maneuvers)
    if not UNCLEAR[0] < refused < UNCLEAR[1]:
        return None
    return repeated_fits(result, maneuvers)


def repeated_fits(
    result: FitResult, maneuvers: Sequence[Maneuver], *, draws: int = DRAWS, seed: int = SEED
) -> Draws | None:
    """Fit again with fresh noise and a fresh prior, `draws` times.

    None for other methods, for a covariance that was widened after the fit (of that the likelihood
    knows nothing) and for records too long to be fitted so often.
    """
    memory = result.details.get("noise_memory")
    if memory is None:
        return None
    plain = OutputProblem(result.model, maneuvers)
    slopes = plain.samples * len(result.model.outputs) * len(plain.names)
    if plain.names != result.names or slopes > MOST_SLOPES:
        return None
    noise = [OutputNoise.from_coefficient(np.trim_zeros(row, "b")) for row in np.atleast_2d(memory)]
    variance = np.asarray(result.details["innovation_variance"])
    free = result.standard_error > 0.0
    prior = np.zeros(len(plain.names))
    prior[: len(result.model.parameters)] = prior_deviation(result, maneuvers) ** -2.0

    def errors(theta: Array) -> tuple[Array, Array]:
        """Return the standard errors of a fit that had ended here, and the spread of its motion."""
        here = minimise(plain, theta, noise=noise, variance=variance, max_iterations=0)
        moved = [replace(m, outputs=r.y.T) for m, r in zip(maneuvers, here.responses, strict=True)]
        spread = regressor_rms(result.model, moved)
        plain.release(here.responses)
        return np.sqrt(np.diag(covariance_of(here.information, free))), spread

    def refitted(data: Sequence[Maneuver], begin: Array, normal: Array) -> Array:
        """Return the most likely vector; `normal` says where the prior lies in its deviations."""
        problem = OutputProblem(result.model, data)
        precision = problem.prior_precision + prior
        known = np.maximum(precision, 1e-300)
        centre = problem.prior_precision * problem.prior_mean / known + normal / np.sqrt(known)
        problem.prior_mean = np.where(precision > 0.0, centre, 0.0)
        problem.prior_precision = precision
        return minimise(
            problem, begin, noise=noise, variance=variance, step_limit=ROUGH, max_iterations=STEPS
        ).theta

    own, _ = errors(result.estimate)
    if np.any(np.abs(own - result.standard_error) > SAME * own):
        return None
    begin = refitted(maneuvers, result.estimate, np.zeros(len(prior)))
    rng = np.random.default_rng(seed)
    found: list[tuple[Array, Array, Array]] = []
    for _ in range(draws):
        shaken = [
            replace(m, outputs=m.outputs + _fresh(noise, variance, m.samples, rng))
            for m in maneuvers
        ]
        try:
            theta = refitted(shaken, begin, rng.standard_normal(len(prior)))
            found.append((theta, *errors(theta)))
        except IdentificationError:
            continue
    if not found:
        return None
    theta, error, spread = (np.array(column) for column in zip(*found, strict=True))
    count = len(result.model.parameters)
    return Draws(theta[:, :count], error[:, :count], spread)


def _fresh(
    noise: Sequence[OutputNoise], variance: Array, samples: int, rng: np.random.Generator
) -> Array:
    """Return noise as the fit found it, (samples, outputs)."""
    white = rng.standard_normal((len(noise), samples)) * np.sqrt(variance)[:, None]
    return np.stack([n.colour(w) for n, w in zip(noise, white, strict=True)], axis=1)
