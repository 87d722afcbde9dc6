"""How far a right model may miss a maneuver that it never saw: noise, gusts, its own covariance.

The noise of an output is an AR model of what a free simulation leaves of the fitted maneuvers and
the inputs do not drive (`numerics.input_coherence`); gusts are in it. A user's model whose states
process noise drives is allowed what that noise makes. For a template with a gust state the AR model
stays the limit, because slow noise may have passed for gusts. What its gusts make decides whether
an output that is missed by half is a failure of the fit.

The parameters are uncertain by their whole covariance. Constants and start states are fitted to the
unseen maneuver too, which takes its part out of the error. Errors are drawn at random, and a gamma
distribution through their mean squares gives the limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.estimators.gust_model import driven_model
from host.sysid.estimators.innovations import driven_states
from host.sysid.models.diagnostics import SignalFit
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.uncertainty import Uncertainty, covariance_root
from host.sysid.numerics.ar_noise import ArNoise, autocovariance
from host.sysid.numerics.input_coherence import InputCoherence, block_length, block_means
from host.sysid.validation.free_simulation import free_responses, weighted_fit
from host.sysid.validation.noise_model_limits import (
    DRAWS,
    measured_means,
    random_errors,
    rarely_exceeded,
    slopes_of_means,
)

FAILS = 0.5  # NRMSE of an output: a quarter of its variance is not explained
LONGEST_LAG = 200  # of an autocorrelation that counts, means
DRAW_SEED = 1


@dataclass(frozen=True, slots=True)
class Prediction:
    """Prediction of an output in unseen maneuvers, in means over `BLOCK_S`.

    Attributes
    ----------
    nrmse : float
        Rms error over the deviation of the output.
    largest : float
        What noise, gusts and the covariance of the parameters allow.
    by_gusts : bool
        The error is no more than what process noise of the fit makes. False for a template where
        `predictions` had no airspeed.
    """

    nrmse: float
    largest: float
    by_gusts: bool = False

    @property
    def holds(self) -> bool:
        """Whether the error is within what is allowed."""
        return self.nrmse <= self.largest


def predictions(
    model: LinearModel,
    result: FitResult,
    known: Uncertainty,
    noise: InputCoherence | None,
    maneuvers: Sequence[Maneuver],
    simulated: Sequence[Array],
    airspeed_mps: float | None = None,
) -> dict[str, Prediction]:
    """Return how each output of unseen maneuvers is predicted; nothing without noise or maneuver.

    Parameters
    ----------
    model : LinearModel
    result : FitResult
    known : Uncertainty
        What is not known of it, every error in it.
    noise : InputCoherence or None
        Coherence of the maneuvers that were fitted.
    maneuvers : sequence of Maneuver
        Unseen.
    simulated : sequence of Array, shape (samples, p)
        Their free simulation.
    airspeed_mps : float, optional
        Airspeed at trim, for the time scale of a template's gusts. Without it they are not drawn.
    """
    if noise is None or not maneuvers:
        return {}
    errors, motions = [], []
    for maneuver, y in zip(maneuvers, simulated, strict=True):
        block = block_length(maneuver.dt_s)
        seen = measured_means(maneuver, block)
        measured, modelled = (
            block_means(x, block, maneuver.sampled) for x in (maneuver.outputs, y)
        )
        errors.append((measured - modelled) * seen)
        mean = np.sum(measured * seen, axis=0) / np.maximum(np.sum(seen, axis=0), 1)
        motions.append((measured - mean) * seen)
    spread = np.sqrt(np.mean(np.vstack(motions) ** 2, axis=0))
    rms = np.sqrt(np.mean(np.vstack(errors) ** 2, axis=0)) / np.maximum(spread, 1e-300)
    process = driven_states(result)
    own = model if process and set(process) <= set(model.states) else None
    largest = largest_rms(model, result, known, noise, maneuvers, own) / np.maximum(spread, 1e-300)
    made = largest if own else np.full(len(rms), -np.inf)
    if process and own is None and airspeed_mps is not None:
        wide = driven_model(model, process, airspeed_mps)
        made = largest_rms(model, result, known, noise, maneuvers, wide) / np.maximum(
            spread, 1e-300
        )
    return {
        name: Prediction(float(rms[k]), float(largest[k]), bool(rms[k] <= made[k]))
        for k, name in enumerate(model.outputs)
    }


def missed(fits: Sequence[SignalFit]) -> bool:
    """Return whether the error of any output is half of its motion or more."""
    return any(not one.nrmse < FAILS for one in fits)


def largest_rms(
    model: LinearModel,
    result: FitResult,
    known: Uncertainty,
    noise: InputCoherence,
    maneuvers: Sequence[Maneuver],
    driven: LinearModel | None = None,
) -> Array:
    """Return the rms error of each output that a right model rarely exceeds, in means, (p,).

    It is exceeded in 1 % of cases by any output; infinite where the model diverges. The errors are
    those of `noise`, or with a model whose states gusts drive (`driven`) what these make.
    """
    count, outputs = len(model.parameter_names), len(model.outputs)
    root = covariance_root(known.covariance[:count, :count])
    rng = np.random.default_rng(DRAW_SEED)
    parameters = rng.standard_normal((DRAWS, count)) @ root.T
    squares, samples = np.zeros((DRAWS, outputs)), 0
    freedom = [power_freedom(memory, noise.samples) for memory in noise.noise]
    scale = np.sqrt(np.array([nu / rng.chisquare(nu, DRAWS) for nu in freedom]))  # of its power
    for maneuver in maneuvers:
        slopes = _slopes(model, result, maneuver)
        if slopes is None:
            return np.full(outputs, np.inf)
        means = slopes.shape[1]
        if driven is not None:
            block = block_length(maneuver.dt_s)
            errors = random_errors(rng, driven, result.estimate, result, maneuver, block)
        else:
            errors = scale[:, None, :] * np.stack(
                [
                    random_noise(rng, memory, variance, means, DRAWS)
                    for memory, variance in zip(noise.noise, noise.innovation_variance, strict=True)
                ]
            )  # (p, means, draws)
        errors += slopes[:, :, :count] @ parameters.T
        left = _without_constants(errors, slopes[:, :, count:], np.mean(errors**2, axis=(1, 2)))
        squares += np.sum(left**2, axis=1).T
        samples += means
    return np.asarray(np.sqrt(rarely_exceeded(squares / samples)))


def power_freedom(memory: ArNoise, samples: int) -> float:
    """Return the degrees of freedom of the mean square of AR noise, samples / (1 + 2 sum rho^2).

    Bartlett, Journal of the Royal Statistical Society, Supplement 8 (1946).
    """
    covariance = autocovariance(memory.coefficient, min(samples, LONGEST_LAG))
    rho = covariance[1:] / covariance[0]
    return max(samples / (1.0 + 2.0 * float(rho @ rho)), 2.0)


def random_noise(
    rng: np.random.Generator, memory: ArNoise, variance: float, samples: int, draws: int
) -> Array:
    """Return stationary AR noise of an innovation variance, (samples, draws)."""
    series = rng.standard_normal((LONGEST_LAG + samples, draws)) * np.sqrt(variance)
    for k in range(memory.order, len(series)):
        for lag, part in enumerate(memory.coefficient, start=1):
            series[k] += part * series[k - lag]
    return np.asarray(series[LONGEST_LAG:])


def _slopes(model: LinearModel, result: FitResult, maneuver: Maneuver) -> Array | None:
    """Return the sensitivities at the estimate, constants fitted, (p, means, P + constants)."""
    free = free_responses(model, result.estimate, [maneuver])
    if free is None:
        return None
    return slopes_of_means(free.problem, 0, free.responses[0])


def _without_constants(errors: Array, columns: Array, power: Array) -> Array:
    weight = 1.0 / np.maximum(power, 1e-300)
    return np.asarray(errors - columns @ weighted_fit(errors, columns, weight))
