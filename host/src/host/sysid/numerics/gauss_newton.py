"""One damped Gauss-Newton search for every likelihood with exact slopes.

Output error, filter error and output error in the frequency domain differ in what a trial costs
and in its slopes; how a step is solved, damped, accepted and called small is the same for all.
Klein & Morelli, Aircraft System Identification, ch. 6 (modified Newton-Raphson); Jategaonkar,
Flight Vehicle System Identification, 2nd ed., ch. 4; damping after Levenberg, Marquardt, Nielsen.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from scipy.linalg import lapack

from host.arrays import Array, BoolArray
from host.sysid.identification_error import IdentificationError

STEP_LIMIT = 0.01  # in Cramer-Rao bounds: below it an iteration is not worth another
MAX_DAMPING = 1e8
INITIAL_DAMPING = 1e-4
MIN_DAMPING = 1e-8
HEAVY_DAMPING = 1e-2  # from here on a short step may be short because it is damped
TOLERANCE = 1e-9  # of the cost: rounding of its sums
RIDGE = 1e-14  # of a scaled information: what keeps flat directions solvable
NOT_FINITE = "the information matrix is not finite; scale or bound the parameters"


class Evaluated(Protocol):
    """A trial that has been evaluated."""

    @property
    def cost(self) -> float:
        """Minus the log likelihood and the prior, up to a constant."""
        ...


Trial = TypeVar("Trial", bound=Evaluated)


class Objective(ABC, Generic[Trial]):
    """What a search wants to know of a likelihood."""

    @abstractmethod
    def evaluate(self, theta: Array) -> Trial | None:
        """Return the trial at these parameters; None where the model fails."""

    @abstractmethod
    def normal(self, theta: Array, trial: Trial) -> tuple[Array, Array]:
        """Return information (P, P) and minus the cost's gradient (P,)."""

    def free(self, theta: Array, gradient: Array) -> BoolArray:
        """Return which parameters no bound holds."""
        return np.ones(len(theta), dtype=bool)

    def reached(self, theta: Array, step: Array) -> Array:
        """Return where a step leads."""
        return theta + step

    def extend_step(
        self, theta: Array, step: Array, size: float, reached: tuple[Array, Trial]
    ) -> tuple[Array, Trial]:
        """Return something better than the end of an undamped step, `size` bounds long."""
        return reached

    def release(self, trial: Trial) -> None:
        """Take back the memory of a trial that nobody reads any more."""


@dataclass(frozen=True, slots=True)
class GaussNewtonResult(Generic[Trial]):
    """Where a search ended.

    Attributes
    ----------
    theta : Array, shape (P,)
    trial
        There.
    information : Array, shape (P, P)
        At the last linearisation.
    free : BoolArray, shape (P,)
        Parameters that do not sit on a bound.
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
    """Search the least cost from `theta`; None if the model fails there.

    Parameters
    ----------
    objective : Objective
    theta : Array, shape (P,)
        Start.
    max_iterations : int
        Most accepted steps.
    step_limit : float
        Ends when no parameter moves further than this times its Cramer-Rao bound.

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
        goal = objective.reached(theta, step)
        next_trial = objective.evaluate(goal)
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
        foreseen = float(gradient @ step - 0.5 * step @ information @ step)
        gain = (trial.cost - next_trial.cost) / foreseen if foreseen > 0.0 else 0.0
        if damping == 0.0:
            goal, next_trial = objective.extend_step(theta, step, size, (goal, next_trial))
        objective.release(trial)
        theta, trial, last = goal, next_trial, size
        iterations += 1
        if size < step_limit and damping < HEAVY_DAMPING:
            converged = True
            break
        # Nielsen, report IMM-REP-1999-05 (DTU): steps that keep less than they promise run from
        # wall to wall of a bent valley, so the damping follows the gain and not mere success.
        damping *= max(0.2, 1.0 - (2.0 * gain - 1.0) ** 3)
        damping, growth = (damping if damping > MIN_DAMPING else 0.0), 2.0
        information, gradient = objective.normal(theta, trial)
    free = objective.free(theta, gradient)
    return GaussNewtonResult(theta, trial, information, free, iterations, converged, float(last))


def free_of_bounds(theta: Array, gradient: Array, lower: Array, upper: Array) -> BoolArray:
    """Return which parameters lie between their bounds or are drawn back from them."""
    return ~(((theta <= lower) & (gradient < 0.0)) | ((theta >= upper) & (gradient > 0.0)))


def damped_step(
    information: Array, gradient: Array, free: BoolArray, damping: float
) -> tuple[Array, float]:
    """Solve (M + damping diag M) step = gradient over the free parameters.

    Returns
    -------
    Array, shape (P,)
        Zero where a bound holds.
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
    if not np.isfinite(block).all():  # dpotrf factors NaN without a word
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
