"""Test whether free simulation leaves more than the fit's own gust and noise predict.

Filter error explains what it cannot simulate as moving air. Driven by that air alone, its model
would miss the measured outputs by a certain rms: more is a model error that the filter followed.
Errors are drawn at random, constants of each maneuver are fitted to them as to the data.
"""

from __future__ import annotations

import numpy as np
from scipy import special

from host.arrays import Array, BoolArray
from host.constants import SIGNIFICANCE
from host.sysid.estimators.coherence_inflation import NoiseExcess
from host.sysid.estimators.gust_model import driven_model
from host.sysid.estimators.innovations import driven_states
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.ar_noise import HIGHEST_ORDER, ArNoise, fit_ar, lagged_moments
from host.sysid.numerics.input_coherence import (
    block_length,
    block_means,
)
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.process_noise import air_states, discrete_noise, steady_covariance
from host.sysid.numerics.score_variance import variance_ratio
from host.sysid.numerics.simulator import Response
from host.sysid.validation.free_simulation import FreeResponses, weighted_fit

DRAWS, DRAW_SEED = 100, 2


def excess_over_noise_model(
    free: FreeResponses, result: FitResult, airspeed_mps: float
) -> NoiseExcess | None:
    """Return the outputs whose residual is larger than predicted; None if there is none.

    Parameters
    ----------
    free : FreeResponses
        Responses of the model as fitted, without gust states, to the maneuvers fitted.
    result : FitResult
        Fit of filter error; nothing is returned for other methods.
    airspeed_mps : float
        Airspeed at trim, for the gust's time scale.

    1 % of right models name any output.
    """
    process = driven_states(result)
    if not process:
        return None
    problem, responses = free.problem, free.responses
    model, maneuvers = problem.model, problem.maneuvers
    wide = driven_model(model, process, airspeed_mps)
    outputs = len(model.outputs)
    observed, samples = np.zeros(outputs), 0
    squares = np.zeros((DRAWS, outputs))
    moments = np.zeros((outputs, HIGHEST_ORDER + 1, HIGHEST_ORDER + 1))
    rng = np.random.default_rng(DRAW_SEED)
    for number, (maneuver, response) in enumerate(zip(maneuvers, responses, strict=True)):
        block = block_length(maneuver.dt_s)
        left = block_means(problem.residual(number, response.y).T, block, maneuver.sampled)
        slopes = slopes_of_means(problem, number, response)[:, :, problem.n_common :]
        errors_drawn = random_errors(rng, wide, free.theta, result, maneuver, block)
        for j, errors in enumerate(errors_drawn):
            # Products of each draw with itself add up, whichever stands for the residual.
            moments[j] += lagged_moments([errors[:, 0]], [errors[:, 1:]], HIGHEST_ORDER)
        weight = 1.0 / np.maximum(np.mean(errors_drawn**2, axis=(1, 2)), 1e-300)
        errors_drawn -= slopes @ weighted_fit(errors_drawn, slopes, weight)
        observed += np.sum(left**2, axis=0)
        squares += np.sum(errors_drawn**2, axis=1).T
        samples += len(left)
    observed, squares = observed / samples, squares / samples
    mean, limit = np.mean(squares, axis=0), rarely_exceeded(squares)
    power = {
        name: float(observed[j] / mean[j])
        for j, name in enumerate(model.outputs)
        if observed[j] > limit[j]
    }
    if not power:
        return None
    fitted = [fit_ar(m, HIGHEST_ORDER) for m in moments]
    count = DRAWS * (samples - HIGHEST_ORDER * len(maneuvers))
    noise = [ArNoise.from_coefficient(coefficient) for coefficient, _ in fitted]
    variance = np.array([innovation / count for _, innovation in fitted])
    return NoiseExcess(power, variance_ratio(problem, responses, noise, variance, power))


def rarely_exceeded(squares: Array) -> Array:
    """Return the mean square that any output exceeds in 1 % of cases, (p,).

    Parameters
    ----------
    squares : Array, shape (draws, p)
        Mean squares as drawn: a gamma distribution goes through them.
    """
    mean, spread = np.mean(squares, axis=0), np.maximum(np.var(squares, axis=0), 1e-300)
    shape = mean**2 / spread
    level = (1.0 - SIGNIFICANCE) ** (1.0 / len(mean))
    return np.asarray(special.gammaincinv(shape, level) * mean / shape)


def random_errors(
    rng: np.random.Generator,
    wide: LinearModel,
    estimate: Array,
    result: FitResult,
    maneuver: Maneuver,
    block: int,
) -> Array:
    """Return outputs of a model that process noise alone drives, and their noise, (p, n, draws).

    Zero where nothing was measured of a mean, as its residual.

    Parameters
    ----------
    rng : numpy.random.Generator
    wide : LinearModel
        With the states that process noise drives.
    estimate : Array
        Its first entries are the parameters of the model.
    result : FitResult
        Fit of filter error, whose noise it is.
    maneuver : Maneuver
        Gives how long, and at which samples each output is measured.
    block : int
        Samples of a mean.
    """
    A, _, C, _ = wide.matrices(estimate[: len(wide.parameters)])
    index = [wide.states.index(s) for s in driven_states(result)]
    intensity = np.zeros(len(A))
    intensity[index] = np.asarray(result.details["process_deviation"]) ** 2
    F, covariance = discrete_noise(A, intensity, block * maneuver.dt_s)
    root = _root(covariance)
    x = np.zeros((len(A), DRAWS))
    air = air_states(wide.states)
    steady = steady_covariance(A[np.ix_(air, air)], intensity[air])
    x[air] = _root(steady) @ rng.standard_normal((len(air), DRAWS))
    means = maneuver.samples // block
    counted = np.maximum(block * np.mean(maneuver.seen, axis=0), 1.0)
    deviation = np.asarray(result.details["noise_deviation"]) / np.sqrt(counted)
    errors = rng.standard_normal((len(C), means, DRAWS)) * deviation[:, None, None]
    for k in range(means):
        errors[:, k] += C @ x
        x = F @ x + root @ rng.standard_normal((len(A), DRAWS))
    return np.asarray(errors * measured_means(maneuver, block).T[:, :, None])


def measured_means(maneuver: Maneuver, block: int) -> BoolArray:
    """Return of which means over `block` samples anything was measured, (means, p)."""
    means = maneuver.samples // block
    return np.asarray(maneuver.seen[: means * block].reshape(means, block, -1).any(axis=1))


def slopes_of_means(problem: OutputProblem, number: int, response: Response) -> Array:
    """Return the sensitivities of what was measured of each mean of a maneuver, (p, means, own)."""
    block = block_length(problem.maneuvers[number].dt_s)
    return np.stack(
        [
            block_means(J, block, problem.seen(number, j))
            for j, J in enumerate(response.sensitivities)
        ]
    )


def _root(covariance: Array) -> Array:
    """Return a root of a covariance, which may be singular: air and air met a little later."""
    value, vector = np.linalg.eigh(covariance)
    return np.asarray(vector * np.sqrt(np.maximum(value, 0.0)))
