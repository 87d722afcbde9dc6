"""Output error by maximum likelihood: Gauss-Newton with exact sensitivities.

Jategaonkar, Flight Vehicle System Identification, 2nd ed., ch. 4; Klein & Morelli, Aircraft System
Identification, ch. 6. The noise covariance is re-estimated in every iteration (relaxation of the
concentrated likelihood), steps are damped only when they fail, bounds freeze and release.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from host.arrays import Array, BoolArray
from host.sysid.errors import IdentificationError
from host.sysid.numerics.noise import OutputNoise
from host.sysid.numerics.problem import OutputProblem, Response

STEP_LIMIT = 0.01  # in Cramer-Rao bounds: below it an iteration is not worth another
MAX_ITERATIONS = 60
MAX_DAMPING = 1e8
FIRST_DAMPING = 1e-4
LEAST_DAMPING = 1e-8
DAMPED = 1e-2  # from here on a short step may be short because it is damped
SINGULAR = 1e-15  # of the largest eigenvalue of the scaled information
UNSEEN = 1e-12  # the same: below, a product of two inverses holds no digit
NOT_FINITE = "the information matrix is not finite; scale or bound the parameters"


@dataclass(frozen=True, slots=True)
class Optimum:
    """Where the search ended.

    `information` is of the whole vector at the last linearisation, `free` marks the parameters that
    do not sit on a bound, `variance` is the innovation variance of each output.
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
    theta: Array
    responses: list[Response]
    residuals: list[Array]  # (p, samples), measured minus model
    whitened: list[Array]
    variance: Array
    cost: float


def minimise(
    problem: OutputProblem,
    theta: Array,
    *,
    noise: Sequence[OutputNoise] | None = None,
    variance: Array | None = None,
    step_limit: float = STEP_LIMIT,
    max_iterations: int = MAX_ITERATIONS,
) -> Optimum:
    """Search the maximum of the (concentrated) likelihood from `theta`.

    Parameters
    ----------
    problem : OutputProblem
        Residuals and slopes.
    theta : Array, shape (P,)
        Start.
    noise : sequence of OutputNoise, optional
        Memory of the noise of each output; white without.
    variance : Array, optional
        Known innovation variances, shape (p,); estimated without.
    step_limit : float
        Ends when no parameter moves further than this times its Cramer-Rao bound.
    max_iterations : int
        Most accepted steps.

    Raises
    ------
    IdentificationError
        If the response at the start leaves all bounds.
    """
    memory = (
        list(noise) if noise is not None else [OutputNoise.white()] * len(problem.model.outputs)
    )
    theta = np.clip(theta, problem.lower, problem.upper)
    point = _evaluate(problem, theta, memory, variance)
    if point is None:
        raise IdentificationError(
            f"model {problem.model.name} diverges at its start values; give other start values"
            " or bounds that keep it finite over the maneuver"
        )
    damping, growth = 0.0, 2.0
    converged = False
    step_size = np.inf
    iterations = 0
    information, gradient = _normal(problem, point, memory)
    while iterations < max_iterations:
        step, free, size = _step(problem, point.theta, information, gradient, damping)
        trial_theta = np.clip(point.theta + step, problem.lower, problem.upper)
        trial = _evaluate(problem, trial_theta, memory, variance)
        tolerance = 1e-9 * (1.0 + abs(point.cost))
        if trial is None or not trial.cost <= point.cost + tolerance:
            if trial is not None:
                problem.release(trial.responses)
            if size < step_limit and damping < DAMPED:
                converged = True
                step_size = size
                break
            damping, growth = max(growth * damping, FIRST_DAMPING), 2.0 * growth
            if damping > MAX_DAMPING:
                break
            continue
        iterations += 1
        foreseen = float(gradient @ step - 0.5 * step @ information @ step)
        gain = (point.cost - trial.cost) / foreseen if foreseen > 0.0 else 0.0
        problem.release(point.responses)
        point = trial
        step_size = size
        accepted_damping = damping
        # Nielsen, report IMM-REP-1999-05 (DTU): steps that keep less than they promise run from
        # wall to wall of a bent valley, so the damping follows the gain and not mere success.
        damping *= max(0.2, 1.0 - (2.0 * gain - 1.0) ** 3)
        damping, growth = (damping if damping > LEAST_DAMPING else 0.0), 2.0
        if size < step_limit and accepted_damping < DAMPED:
            converged = True
            break
        information, gradient = _normal(problem, point, memory)
    free = _free(problem, point.theta, gradient)
    return Optimum(
        theta=point.theta,
        information=information,
        free=free,
        variance=point.variance,
        residuals=point.residuals,
        responses=point.responses,
        cost=point.cost,
        iterations=iterations,
        converged=converged,
        step=float(step_size),
    )


def whitened_slopes(
    problem: OutputProblem, responses: Sequence[Response], noise: Sequence[OutputNoise]
) -> list[Array]:
    """Return slopes of each maneuver filtered by the noise memory, (p, samples, columns)."""
    result = []
    for response in responses:
        if all(n.order == 0 for n in noise):
            result.append(response.slopes)
        else:
            result.append(
                np.stack([n.whiten(response.slopes[j]) for j, n in enumerate(noise)], axis=0)
            )
    return result


def covariance_of(information: Array, free: BoolArray) -> Array:
    """Invert an information matrix over the free parameters; others get zero.

    Raises
    ------
    IdentificationError
        If a parameter acts on no output at all.
    """
    covariance = np.zeros_like(information)
    if not free.any():
        return covariance
    block = information[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.diag(block), 0.0))
    if np.any(scale == 0.0):
        raise IdentificationError("singular information: a parameter does not act on any output")
    value, vector = np.linalg.eigh(block / np.outer(scale, scale))
    # Directions the data do not see get a huge variance, not an exception: they will be named.
    value = np.maximum(value, SINGULAR * value[-1])
    inverse = (vector / value) @ vector.T / np.outer(scale, scale)
    covariance[np.ix_(free, free)] = 0.5 * (inverse + inverse.T)
    return covariance


def unseen(information: Array, free: BoolArray) -> Array:
    """Return the covariance of directions that the data do not see, zero where they see all.

    Corrections for coloured residuals multiply by the inverse twice; along these directions only
    rounding is left of them, which looks like a narrow interval.
    """
    result = np.zeros_like(information)
    if not free.any():
        return result
    block = information[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    value, vector = np.linalg.eigh(block / np.outer(scale, scale))
    lost = value < UNSEEN * value[-1]
    if lost.any():
        value = np.maximum(value[lost], SINGULAR * value[-1])
        part = (vector[:, lost] / value) @ vector[:, lost].T
        result[np.ix_(free, free)] = part / np.outer(scale, scale)
    return result


def _evaluate(
    problem: OutputProblem,
    theta: Array,
    noise: Sequence[OutputNoise],
    variance: Array | None,
) -> _Point | None:
    responses = problem.respond(theta)
    if responses is None:
        return None
    residuals: list[Array] = []
    whitened: list[Array] = []
    for number, response in enumerate(responses):
        residual = problem.measured(number) - response.y
        if not np.isfinite(residual).all():
            return None
        residuals.append(residual)
        whitened.append(_whitened(residual, noise))
    squares = sum((np.einsum("jk,jk->j", w, w) for w in whitened), np.zeros(len(noise)))
    prior = 0.5 * float(np.sum(problem.prior_precision * (theta - problem.prior_mean) ** 2))
    if variance is None:
        estimated = np.maximum(squares / problem.samples, problem.least_variance)
        cost = 0.5 * problem.samples * float(np.sum(np.log(estimated)))
    else:
        estimated = variance
        cost = 0.5 * float(np.sum(squares / variance))
    if not np.isfinite(cost):
        return None
    return _Point(theta, responses, residuals, whitened, estimated, cost + prior)


def _whitened(residual: Array, noise: Sequence[OutputNoise]) -> Array:
    if all(n.order == 0 for n in noise):
        return residual
    return np.stack([n.whiten(residual[j][:, None])[:, 0] for j, n in enumerate(noise)])


def _normal(
    problem: OutputProblem, point: _Point, noise: Sequence[OutputNoise]
) -> tuple[Array, Array]:
    size = len(problem.names)
    information = np.diag(problem.prior_precision)
    gradient = problem.prior_precision * (problem.prior_mean - point.theta)
    for number, slopes in enumerate(whitened_slopes(problem, point.responses, noise)):
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


def _free(problem: OutputProblem, theta: Array, gradient: Array) -> BoolArray:
    low = (theta <= problem.lower) & (gradient < 0.0)
    high = (theta >= problem.upper) & (gradient > 0.0)
    return ~(low | high)


def _step(
    problem: OutputProblem, theta: Array, information: Array, gradient: Array, damping: float
) -> tuple[Array, BoolArray, float]:
    """Solve for the step over parameters not held by a bound; size is in Cramer-Rao bounds."""
    free = _free(problem, theta, gradient)
    step = np.zeros(len(theta))
    if not free.any():
        return step, free, 0.0
    block = information[np.ix_(free, free)]
    if not np.isfinite(block).all():  # dpotrf factors NaN without a word
        raise IdentificationError(NOT_FINITE)
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    scaled = block / np.outer(scale, scale)
    ridge = max(damping, 1e-14)
    factor, failed = lapack.dpotrf(scaled + ridge * np.eye(len(block)), lower=1)
    while failed:
        ridge *= 10.0
        if not ridge <= MAX_DAMPING:
            raise IdentificationError(NOT_FINITE)
        factor, failed = lapack.dpotrf(scaled + ridge * np.eye(len(block)), lower=1)
    inverse = np.tril(lapack.dtrtri(factor, lower=1)[0])
    move = inverse.T @ (inverse @ (gradient[free] / scale))
    bound = np.sqrt(np.einsum("ij,ij->j", inverse, inverse))
    step[free] = move / scale
    return step, free, float(np.max(np.abs(move) / bound, initial=0.0))
