"""Filter error: maximum likelihood with process noise (turbulence) and measurement noise.

Innovations of a steady-state Kalman filter are the residuals; the search is Fisher scoring on their
exact Gaussian likelihood (`numerics/filter_problem.py`, `numerics/filter_scoring.py`).
Jategaonkar, Flight Vehicle System Identification, 2nd ed., ch. 5; Klein & Morelli, ch. 6.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array, BoolArray
from host.sysid.errors import IdentificationError
from host.sysid.estimators.misfit import misfit_factor, widened_names
from host.sysid.estimators.rival import against_coloured_noise
from host.sysid.estimators.start import start_values
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import LinearModel
from host.sysid.models.result import FitResult
from host.sysid.numerics.filter_problem import FilterProblem, Likelihood
from host.sysid.numerics.filter_scoring import scoring, summed, whitened_slopes
from host.sysid.numerics.inverse import covariance_of
from host.sysid.numerics.output_error import minimise
from host.sysid.numerics.problem import OutputProblem
from host.sysid.numerics.repeats import pulls

STEP_LIMIT = 0.01
# Fisher's information overstates the curvature by the noise of a sensor that is smoother than any:
# steps towards zero are all too short, by the same share. A longer one is tried for a fifth of what
# new slopes cost: 12 to 20 iterations instead of 22 to 60.
FAR_FROM = 0.5  # bounds
FARTHEST = 32.0
VARIANCE = (0.01, 100.0)  # times what it was: most of one step
MAX_ITERATIONS = 60
NOISE_FLOOR = 1e-3  # of an output's deviation, or of the first guess of process noise
# First guess of the deviations: sensors share the residuals of output error with process noise.
# A guess of process noise that is too small starves the gain, and the search ends elsewhere.
NOISE_SHARE, PROCESS_SHARE = 0.6, 2.7
HIDDEN = 0.1  # rad, rad/s or m/s: what no output shows at once is not taken for larger
SLOWEST = 0.1  # rad/s, of a state that forgets its process noise


def fit_filter_error(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: tuple[str, ...] | None = None,
    start: Array | None = None,
    rival: bool = True,
    misfit: bool = False,
) -> FitResult:
    """Fit by filter error.

    Parameters
    ----------
    model, maneuvers
        Model and data. A gust can be a state of its own, its entries tied to those of alpha.
    process : tuple of str, optional
        States driven by white process noise; without, all whose rate has a free entry.
    start : Array, optional
        Start of the model's own vector; output error gives it without.
    rival : bool
        Ask whether sensor noise with a memory explains the data better (`rival`).
    misfit : bool
        Widen intervals by what neighbouring scores have in common (`misfit`).

    Raises
    ------
    IdentificationError
        If no start is finite.
    """
    if process is None:
        rows = {t.row for t in model.terms if t.matrix == "A"}
        process = tuple(model.states[i] for i in sorted(rows))
    problem = FilterProblem(model, maneuvers, process)
    first = start_values(problem.inner) if start is None else np.asarray(start, dtype=np.float64)
    theta = _first_guess(problem, first, fit_first=start is None)
    point = problem.evaluate(theta)
    if point is None:
        raise IdentificationError(f"model {model.name}: the Kalman filter fails at the start")
    quiet = np.maximum(np.std(np.vstack([m.outputs for m in maneuvers]), axis=0), 1e-9)
    # Noise that the data do not show would walk to nothing for ever, and the search with it.
    floor = np.log(NOISE_FLOOR) + np.concatenate(
        [theta[problem.n_model : problem.n_model + len(process)], np.log(quiet)]
    )
    noise = slice(problem.n_model, None)
    damping, converged, iterations, size = 0.0, False, 0, np.inf
    parts, scores = scoring(problem, theta, point)
    information, gradient = summed(problem, theta, parts, scores)
    while iterations < MAX_ITERATIONS:
        held = np.zeros(len(theta), dtype=bool)
        held[noise] = (theta[noise] <= floor) & (gradient[noise] < 0.0)
        held[: problem.n_model] = ~_free(problem.inner, theta, gradient)
        step, size = _step(information, gradient, damping, ~held)
        trial_theta = _reached(problem, theta, step, floor)
        trial = problem.evaluate(trial_theta)
        if trial is None or trial.cost > point.cost + 1e-9 * abs(point.cost):
            if size < STEP_LIMIT:
                converged = True
                break
            damping = max(4.0 * damping, 1e-3)
            if damping > 1e8:
                break
            continue
        if size > FAR_FROM and damping == 0.0:
            trial_theta, trial = _farther(problem, theta, step, floor, (trial_theta, trial))
        theta, point = trial_theta, trial
        iterations += 1
        if size < STEP_LIMIT and damping < 1e-2:
            converged = True
            break
        damping = 0.0 if damping < 1e-3 else damping / 8.0
        parts, scores = scoring(problem, theta, point)
        information, gradient = summed(problem, theta, parts, scores)
    covariance = covariance_of(information)
    factor: Array = np.ones(len(theta))
    if misfit:
        white = [
            e @ point.gains[m.dt_s].whitener.T for e, m in zip(point.e, maneuvers, strict=True)
        ]
        steps_s = [m.dt_s for m in maneuvers]
        factor = misfit_factor(whitened_slopes(problem, theta, point), white, steps_s, covariance)
    kept = problem.n_model
    warnings = [] if converged else [f"no convergence: last step {size:.3g} bounds long"]
    warnings += widened_names(model, factor)
    result = FitResult(
        method="filter error",
        model=model,
        names=problem.names,
        estimate=theta,
        covariance=covariance * np.outer(factor, factor),
        covariance_white=covariance,
        degrees_of_freedom=np.full(len(theta), float(max(problem.inner.samples - kept, 1))),
        residuals=tuple(point.e),
        fitted=tuple(m.outputs - e for m, e in zip(maneuvers, point.e, strict=True)),
        residual_kind="innovation",
        noise_covariance=np.atleast_2d(np.cov(np.vstack(point.e).T)),
        iterations=iterations,
        converged=converged,
        warnings=tuple(warnings),
        details={
            "cost": point.cost,
            "misfit": factor,
            "process_deviation": np.exp(theta[kept : kept + len(process)]),
            "noise_deviation": np.exp(theta[kept + len(process) :]),
            **pulls(parts, scores, covariance),
        },
    )
    return against_coloured_noise(result, maneuvers, first) if rival else result


def information_at(
    model: LinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...], theta: Array
) -> Array:
    """Return the Fisher information of the stochastic model at given values of everything.

    Parameters
    ----------
    model, maneuvers, process
        As for `fit_filter_error`.
    theta : Array
        The vector of a filter-error result: model and constants, log process and noise deviations.

    Raises
    ------
    IdentificationError
        If the filter fails there.
    """
    problem = FilterProblem(model, maneuvers, process)
    point = problem.evaluate(theta)
    if point is None:
        raise IdentificationError(f"model {model.name}: the Kalman filter fails at these values")
    parts, scores = scoring(problem, theta, point)
    return summed(problem, theta, parts, scores)[0]


def _first_guess(problem: FilterProblem, first: Array, *, fit_first: bool) -> Array:
    """Start from output error; split its residuals between both kinds of noise."""
    inner, model = problem.inner, problem.model
    optimum = minimise(inner, first, max_iterations=15 if fit_first else 0)
    deviation = np.maximum(np.std(np.hstack(optimum.residuals), axis=1), 1e-12)
    A, _, C, _ = model.matrices(optimum.theta)
    process = []
    for i in problem.process_index:
        # The smallest motion of this state that would explain the residual of an output.
        size = float(np.min(deviation / np.maximum(np.abs(C[:, i]), 1e-9), initial=HIDDEN))
        process.append(PROCESS_SHARE * size * np.sqrt(2.0 * max(-A[i, i], SLOWEST)))
    return np.concatenate([optimum.theta, np.log(process), np.log(NOISE_SHARE * deviation)])


def _reached(
    problem: FilterProblem, theta: Array, step: Array, floor: Array, far: float = 1.0
) -> Array:
    """Return where a step leads: noise moves by its variance, which may come to nothing at once."""
    inner, noise = problem.inner, slice(problem.n_model, None)
    goal = theta + far * step
    goal[noise] = theta[noise] + 0.5 * np.log(np.clip(1.0 + 2.0 * far * step[noise], *VARIANCE))
    goal[: problem.n_model] = np.clip(goal[: problem.n_model], inner.lower, inner.upper)
    goal[noise] = np.maximum(goal[noise], floor)
    return goal


def _farther(
    problem: FilterProblem,
    theta: Array,
    step: Array,
    floor: Array,
    best: tuple[Array, Likelihood],
) -> tuple[Array, Likelihood]:
    """Return the best of a step and its doubles, as long as they gain."""
    far = 2.0
    while far <= FARTHEST:
        goal = _reached(problem, theta, step, floor, far)
        trial = problem.evaluate(goal)
        if trial is None or trial.cost >= best[1].cost:
            break
        best = goal, trial
        far *= 2.0
    return best


def _free(inner: OutputProblem, theta: Array, gradient: Array) -> BoolArray:
    own, slope = theta[: len(inner.names)], gradient[: len(inner.names)]
    return ~(((own <= inner.lower) & (slope < 0.0)) | ((own >= inner.upper) & (slope > 0.0)))


def _step(
    information: Array, gradient: Array, damping: float, free: BoolArray
) -> tuple[Array, float]:
    full = np.zeros(len(gradient))
    information, gradient = information[np.ix_(free, free)], gradient[free]
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information / np.outer(scale, scale)
    value, vector = np.linalg.eigh(scaled)
    value = np.maximum(value, 1e-12 * value[-1])
    bound = np.sqrt(np.einsum("ij,j,ij->i", vector, 1.0 / value, vector))
    move = vector @ ((vector.T @ (gradient / scale)) / (value + damping))
    full[free] = move / scale
    return full, float(np.max(np.abs(move) / bound, initial=0.0))
