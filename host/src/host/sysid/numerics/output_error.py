"""Output error by maximum likelihood, with exact sensitivities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.sysid.numerics.ar_noise import ArNoise
from host.sysid.numerics.gauss_newton import (
    STEP_LIMIT,
    Objective,
    free_of_bounds,
    gauss_newton,
)
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import Response

MAX_ITERATIONS = 60
MOST_NAMED = 5
SINGULAR = 1e-15  # of the largest eigenvalue of the scaled information
UNIDENTIFIABLE = 1e-12  # the same: below it a product of two inverses has no correct digit


@dataclass(frozen=True, slots=True)
class Optimum:
    """Maximum of the likelihood.

    `information` is that of the whole vector at the last linearisation, `free` marks parameters
    that are not on a bound, `variance` is the innovation variance of each output.
    """

    theta: Array
    information: Array
    free: BoolArray
    variance: Array
    residuals: list[Array]
    responses: list[Response]
    cost: float
    iterations: int
    converged: bool
    step: float


@dataclass(slots=True)
class _Point:
    responses: list[Response]
    residuals: list[Array]  # (p, samples), measured minus model
    whitened: list[Array]
    variance: Array
    cost: float


def minimise(
    problem: OutputProblem,
    theta: Array,
    *,
    noise: Sequence[ArNoise] | None = None,
    variance: Array | None = None,
    step_limit: float = STEP_LIMIT,
    max_iterations: int = MAX_ITERATIONS,
) -> Optimum:
    """Maximise the (concentrated) likelihood from `theta`.

    The cost is J = 1/2 sum_j N ln s_j with s_j the variance of output j's innovations, concentrated
    out of the Gaussian likelihood and re-estimated at every step, or 1/2 sum v_j'v_j / s_j with s_j
    given (EQUATIONS.md, eq. 24); plus the prior.

    Parameters
    ----------
    problem : OutputProblem
        Residuals and sensitivities.
    theta : Array, shape (P,)
        Start.
    noise : sequence of ArNoise, optional
        AR model of the noise of each output; white by default.
    variance : Array, optional
        Known innovation variances, shape (p,), NaN where estimated; those that the model states
        without.
    step_limit : float
        The search ends when no parameter moves by more than this times its Cramer-Rao bound.
    max_iterations : int
        Most accepted steps.

    Raises
    ------
    IdentificationError
        If the response at the start diverges.
    """
    ar_models = list(noise) if noise is not None else [ArNoise.white()] * len(problem.model.outputs)
    search = partial(
        gauss_newton,
        _OutputError(problem, ar_models, variance),
        max_iterations=max_iterations,
        step_limit=step_limit,
    )
    found = search(np.clip(theta, problem.lower, problem.upper))
    while found is not None and problem.refine_step(found.theta):
        found = search(found.theta) or found
    if found is None:
        raise IdentificationError(
            f"model {problem.model.name} diverges at its start values; give other start values"
            " or bounds that keep it finite over the maneuver"
        )
    point = found.trial
    return Optimum(
        theta=found.theta,
        information=found.information,
        free=found.free,
        variance=point.variance,
        residuals=point.residuals,
        responses=point.responses,
        cost=point.cost,
        iterations=found.iterations,
        converged=found.converged,
        step=found.step,
    )


class _OutputError(Objective[_Point]):
    """Residuals of outputs whose noise variance is concentrated out, or known."""

    def __init__(
        self, problem: OutputProblem, noise: Sequence[ArNoise], variance: Array | None
    ) -> None:
        self._problem, self._noise, self._variance = problem, noise, variance

    def evaluate(self, theta: Array) -> _Point | None:
        return _evaluate(self._problem, theta, self._noise, self._variance)

    def normal(self, theta: Array, trial: _Point) -> tuple[Array, Array]:
        return _normal(self._problem, theta, trial, self._noise)

    def free(self, theta: Array, gradient: Array) -> BoolArray:
        return free_of_bounds(theta, gradient, self._problem.lower, self._problem.upper)

    def apply_step(self, theta: Array, step: Array) -> Array:
        return np.clip(theta + step, self._problem.lower, self._problem.upper)

    def release(self, trial: _Point) -> None:
        self._problem.release(trial.responses)


def whitened_sensitivities(
    problem: OutputProblem, responses: Sequence[Response], noise: Sequence[ArNoise]
) -> list[Array]:
    """Return sensitivities of each maneuver, whitened by the AR models, (p, samples, columns)."""
    result = []
    for response in responses:
        if all(n.order == 0 for n in noise):
            result.append(response.sensitivities)
        else:
            result.append(
                np.stack([n.whiten(response.sensitivities[j]) for j, n in enumerate(noise)], axis=0)
            )
    return result


def covariance_of_free(
    information: Array, free: BoolArray, names: Sequence[str] | None = None
) -> Array:
    """Return the Cramer-Rao covariance over the free parameters; that of others is zero.

    Parameters
    ----------
    information : Array, shape (P, P)
    free : BoolArray, shape (P,)
    names : sequence of str, optional
        Names of the parameters; by default their numbers from 1.

    Raises
    ------
    IdentificationError
        If a parameter acts on no output at all; the line names it.
    """
    covariance = np.zeros_like(information)
    if not free.any():
        return covariance
    block = information[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.diag(block), 0.0))
    silent = np.flatnonzero(free)[scale == 0.0]
    idle = [f"parameter {k + 1}" if names is None else names[k] for k in silent]
    if idle:
        raise IdentificationError(
            f"singular information: {', '.join(idle[:MOST_NAMED])} acts on no output in these"
            " maneuvers; make it known, give it a prior, or fly where it acts"
        )
    value, vector = np.linalg.eigh(block / np.outer(scale, scale))
    # Directions without information get a huge variance, not an exception: they are flagged later.
    value = np.maximum(value, SINGULAR * value[-1])
    inverse = (vector / value) @ vector.T / np.outer(scale, scale)
    covariance[np.ix_(free, free)] = 0.5 * (inverse + inverse.T)
    return covariance


def unidentifiable_covariance(information: Array, free: BoolArray) -> Array:
    """Return the covariance of directions without information, zero where there is none.

    Corrections for coloured residuals multiply by the inverse twice. Along these directions only
    rounding remains of the product, which would look like a narrow interval.
    """
    result = np.zeros_like(information)
    if not free.any():
        return result
    block = information[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    value, vector = np.linalg.eigh(block / np.outer(scale, scale))
    unidentified = value < UNIDENTIFIABLE * value[-1]
    if unidentified.any():
        value = np.maximum(value[unidentified], SINGULAR * value[-1])
        part = (vector[:, unidentified] / value) @ vector[:, unidentified].T
        result[np.ix_(free, free)] = part / np.outer(scale, scale)
    return result


def _evaluate(
    problem: OutputProblem,
    theta: Array,
    noise: Sequence[ArNoise],
    variance: Array | None,
) -> _Point | None:
    responses = problem.respond(theta)
    if responses is None:
        return None
    residuals: list[Array] = []
    whitened: list[Array] = []
    for number, response in enumerate(responses):
        residual = problem.residual(number, response.y)
        if not np.isfinite(residual).all():
            return None
        residuals.append(residual)
        whitened.append(_whitened(residual, noise))
    squares = sum((np.einsum("jk,jk->j", w, w) for w in whitened), np.zeros(len(noise)))
    prior = 0.5 * float(np.sum(problem.prior_precision * (theta - problem.prior_mean) ** 2))
    known = problem.known_variance if variance is None else variance
    open_ = np.isnan(known)
    estimated = np.maximum(squares / problem.counts, problem.least_variance)
    # What a fit leaves below the least variance still counts, as residuals of known noise do.
    rest = squares / problem.counts / estimated - 1.0
    least = np.minimum(rest, 0.0)
    cost = 0.5 * float(np.sum((problem.counts * (np.log(estimated) + least))[open_]))
    cost += 0.5 * float(np.sum((squares / known)[~open_]))
    estimated = np.where(open_, estimated, known)
    if not np.isfinite(cost):
        return None
    return _Point(responses, residuals, whitened, estimated, cost + prior)


def _whitened(residual: Array, noise: Sequence[ArNoise]) -> Array:
    if all(n.order == 0 for n in noise):
        return residual
    return np.stack([n.whiten(residual[j][:, None])[:, 0] for j, n in enumerate(noise)])


def _normal(
    problem: OutputProblem, theta: Array, point: _Point, noise: Sequence[ArNoise]
) -> tuple[Array, Array]:
    size = len(problem.names)
    information = np.diag(problem.prior_precision)
    gradient = problem.prior_precision * (problem.prior_mean - theta)
    for number, slopes in enumerate(whitened_sensitivities(problem, point.responses, noise)):
        columns = problem.columns(number)
        block = np.zeros((len(columns), len(columns)))
        right = np.zeros(len(columns))
        for j in range(len(slopes)):
            weight = 1.0 / point.variance[j]
            block += weight * (slopes[j].T @ slopes[j])
            right += weight * (slopes[j].T @ point.whitened[number][j])
        if len(columns) == size and number == 0:
            information += block
            gradient = gradient + right
        else:
            information[np.ix_(columns, columns)] += block
            gradient[columns] += right
    return information, gradient
