"""Damped Gauss-Newton search, shared by all likelihoods with exact sensitivities.

Output error, filter error and output error in the frequency domain have costs and sensitivities of
their own. Solving, damping and accepting a step and the test of convergence are the same for all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from scipy.linalg import lapack

from host.arrays import Array, BoolArray
from host.errors import IdentificationError

STEP_LIMIT = 0.01  # in Cramer-Rao bounds: convergence
MAX_DAMPING = 1e8
INITIAL_DAMPING = 1e-4
MIN_DAMPING = 1e-8
HEAVY_DAMPING = 1e-2  # from here on a step may be much shorter than without
TOLERANCE = 1e-9  # of the cost: rounding of its sums
RIDGE = 1e-14  # of a scaled information: keeps flat directions solvable
NOT_FINITE = "the information matrix is not finite; scale or bound the parameters"


class Evaluated(Protocol):
    """Result of evaluating the cost at one set of parameters."""

    @property
    def cost(self) -> float:
        """Negative log likelihood and prior, up to a constant."""
        ...


Trial = TypeVar("Trial", bound=Evaluated)


@dataclass(frozen=True, slots=True)
class StepLine:
    """A step to be adjusted in length.

    Attributes
    ----------
    theta : Array, shape (P,)
        Where it starts.
    step : Array, shape (P,)
    size : float
        Its length in Cramer-Rao bounds.
    cost, decrease : float
        Cost at `theta`, and how fast it falls there per length of the step.
    damped : bool
    """

    theta: Array
    step: Array
    size: float
    cost: float
    decrease: float
    damped: bool


class Objective(ABC, Generic[Trial]):
    """Cost function of a search: its value, information and gradient."""

    @abstractmethod
    def evaluate(self, theta: Array) -> Trial | None:
        """Evaluate the cost at these parameters; None where the model fails."""

    @abstractmethod
    def normal(self, theta: Array, trial: Trial) -> tuple[Array, Array]:
        """Return information (P, P) and negative gradient of the cost (P,)."""

    def free(self, theta: Array, gradient: Array) -> BoolArray:
        """Return which parameters may move: those not held by a bound."""
        return np.ones(len(theta), dtype=bool)

    def apply_step(self, theta: Array, step: Array) -> Array:
        """Return the parameters after a step."""
        return theta + step

    def adjust_step(self, line: StepLine, reached: tuple[Array, Trial]) -> tuple[Array, Trial]:
        """Return a better point along a step that was accepted, if any."""
        return reached

    def release(self, trial: Trial) -> None:
        """Free the memory of a trial that is no longer needed."""


@dataclass(frozen=True, slots=True)
class GaussNewtonResult(Generic[Trial]):
    """Result of a search.

    Attributes
    ----------
    theta : Array, shape (P,)
        Estimate.
    trial
        Evaluation at `theta`.
    information : Array, shape (P, P)
        At the last linearisation.
    free : BoolArray, shape (P,)
        Parameters that are not on a bound.
    iterations : int
        Accepted steps.
    converged : bool
    step : float
        Length of the last step in Cramer-Rao bounds.
    """

    theta: Array
    trial: Trial
    information: Array
    free: BoolArray
    iterations: int
    converged: bool
    step: float


def gauss_newton(
    objective: Objective[Trial],
    theta: Array,
    *,
    max_iterations: int,
    step_limit: float = STEP_LIMIT,
) -> GaussNewtonResult[Trial] | None:
    """Minimise the cost from `theta`; None if the model fails there.

    EQUATIONS.md, eq. 26 (modified Newton-Raphson).

    Parameters
    ----------
    objective : Objective
    theta : Array, shape (P,)
        Start.
    max_iterations : int
        Most accepted steps.
    step_limit : float
        The search ends when no parameter moves by more than this times its Cramer-Rao bound.

    Raises
    ------
    IdentificationError
        If the information is not finite.
    """
    trial = objective.evaluate(theta)
    if trial is None:
        return None
    damping, growth = 0.0, 2.0
    converged = False
    last = np.inf
    iterations = 0
    information, gradient = objective.normal(theta, trial)
    while iterations < max_iterations:
        free = objective.free(theta, gradient)
        step, size = damped_step(information, gradient, free, damping)
        proposal = objective.apply_step(theta, step)
        next_trial = objective.evaluate(proposal)
        tolerance = TOLERANCE * (1.0 + abs(trial.cost))
        if next_trial is None or not next_trial.cost <= trial.cost + tolerance:
            if next_trial is not None:
                objective.release(next_trial)
            if size < step_limit and damping < HEAVY_DAMPING:
                converged, last = True, size
                break
            damping, growth = max(growth * damping, INITIAL_DAMPING), 2.0 * growth
            if damping > MAX_DAMPING:
                break
            continue
        predicted_decrease = float(gradient @ step - 0.5 * step @ information @ step)
        gain_ratio = (
            (trial.cost - next_trial.cost) / predicted_decrease if predicted_decrease > 0.0 else 0.0
        )
        line = StepLine(theta, step, size, trial.cost, float(gradient @ step), damping > 0.0)
        proposal, next_trial = objective.adjust_step(line, (proposal, next_trial))
        objective.release(trial)
        theta, trial, last = proposal, next_trial, size
        iterations += 1
        if size < step_limit and _undamped_size(information, gradient, free, damping) < step_limit:
            converged = True
            break
        # Nielsen, report IMM-REP-1999-05 (DTU): the damping follows the ratio of actual to
        # predicted decrease, because steps in a curved valley that merely succeed zigzag between
        # its walls.
        damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain_ratio - 1.0) ** 3)
        damping, growth = (damping if damping > MIN_DAMPING else 0.0), 2.0
        information, gradient = objective.normal(theta, trial)
    free = objective.free(theta, gradient)
    return GaussNewtonResult(theta, trial, information, free, iterations, converged, float(last))


def _undamped_size(information: Array, gradient: Array, free: BoolArray, damping: float) -> float:
    """Return the length of the step without damping: a step may be short only because of it."""
    return damped_step(information, gradient, free, 0.0)[1] if damping >= HEAVY_DAMPING else 0.0


def free_of_bounds(theta: Array, gradient: Array, lower: Array, upper: Array) -> BoolArray:
    """Return which parameters lie between their bounds or would move away from one."""
    return ~(((theta <= lower) & (gradient < 0.0)) | ((theta >= upper) & (gradient > 0.0)))


def damped_step(
    information: Array, gradient: Array, free: BoolArray, damping: float
) -> tuple[Array, float]:
    """Solve (M + damping diag M) step = gradient over the free parameters.

    Levenberg, Quarterly of Applied Mathematics 2 (1944); Marquardt, SIAM Journal 11 (1963).

    Returns
    -------
    Array, shape (P,)
        Zero for parameters on a bound.
    float
        Its largest component in Cramer-Rao bounds.

    Raises
    ------
    IdentificationError
        If the information is not finite.
    """
    step = np.zeros(len(gradient))
    if not free.any():
        return step, 0.0
    block = information[np.ix_(free, free)]
    if not np.isfinite(block).all():  # dpotrf factors NaN without an error
        raise IdentificationError(NOT_FINITE)
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    scaled = block / np.outer(scale, scale)
    ridge = max(damping, RIDGE)
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
    return step, float(np.max(np.abs(move) / bound, initial=0.0))
