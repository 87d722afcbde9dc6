"""Filter error: maximum likelihood with process noise (turbulence) and measurement noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.innovation_search import InnovationObjective, first_noise, noise_floor
from host.sysid.estimators.innovations import hac_inflation, inflation_lines
from host.sysid.estimators.noise_model_comparison import compare_noise_models
from host.sysid.estimators.output_error_fit import fit_output_error
from host.sysid.estimators.start_values import start_values
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.filter_problem import FilterProblem
from host.sysid.numerics.gauss_newton import (
    STEP_LIMIT,
    GaussNewtonResult,
    gauss_newton,
)
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.innovation_problem import InnovationLikelihood, InnovationProblem
from host.sysid.numerics.maneuver_agreement import maneuver_influence
from host.sysid.numerics.model_problems import innovation_problem, needs_compiler
from host.sysid.numerics.output_error import minimise

MAX_ITERATIONS = 60
NEAR_BOUNDS = 0.2  # Cramer-Rao bounds: a search that still creeps by so little has ended


def fit_filter_error(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: tuple[str, ...] | None = None,
    start: Array | None = None,
    noise: Array | None = None,
    roughly: bool = False,
    compare_noise: bool = True,
    hac: bool = False,
    must_end: bool = False,
) -> FitResult:
    """Fit by filter error.

    The residuals are the innovations of a Kalman filter, extended where a model has equations; the
    search is Fisher scoring on their exact Gaussian likelihood (Jategaonkar, Flight Vehicle System
    Identification, 2nd ed., ch. 5; Klein & Morelli, Aircraft System Identification, ch. 6).

    Parameters
    ----------
    model, maneuvers
        Model and data. A gust can be a state of its own, its entries tied to those of alpha.
    process : tuple of str, optional
        States driven by white process noise; by default those of the model's equations, or all
        whose equation has a free parameter.
    start : Array, optional
        Start of the vector without noise parameters; by default from output error.
    noise : Array, optional
        Start of the logarithms of process and measurement deviations; by default guessed.
    roughly : bool
        End the search within `NEAR_BOUNDS` of the optimum, to start another from.
    compare_noise : bool
        Ask whether coloured measurement noise explains the data better (`compare_noise_models`).
    hac : bool
        Inflate standard errors by the autocorrelation of the scores (`hac_inflation`).
    must_end : bool
        Refuse a search that neither converges nor ends near its optimum, before a result is made.

    Raises
    ------
    IdentificationError
        If no start is finite, or there is no compiler for a filter of so many samples; with
        `must_end` also if the search did not end.
    """
    slow = needs_compiler(model, maneuvers)
    if slow:
        raise IdentificationError(slow)
    problem = innovation_problem(model, maneuvers, _driven(model) if process is None else process)
    first, theta = _started(problem, start, noise)
    n_noise = problem.n_model + len(problem.process)
    floor = noise_floor(maneuvers, theta[problem.n_model : n_noise])
    objective = InnovationObjective(problem, floor)
    limit = NEAR_BOUNDS if roughly else STEP_LIMIT
    found = gauss_newton(objective, theta, max_iterations=MAX_ITERATIONS, step_limit=limit)
    if found is None:
        raise IdentificationError(f"model {model.name}: the Kalman filter fails at the start")
    creeps = f"no convergence: last step {found.step:.3g} bounds long"
    if must_end and not _near(found.step, converged=found.converged):
        raise IdentificationError(creeps)
    covariance = covariance_from_information(found.information)
    theta, point, n_model = found.theta, found.trial, problem.n_model
    factor = _inflation(problem, found, covariance) if hac else np.ones(len(theta))
    warnings = [*(() if found.converged else (creeps,)), *inflation_lines(model, factor)]
    result = FitResult(
        method="filter error",
        model=problem.output_problem.model_at(theta[:n_model]),
        names=problem.names,
        estimate=theta,
        covariance=covariance * np.outer(factor, factor),
        covariance_white=covariance,
        degrees_of_freedom=np.full(
            len(theta), float(max(problem.output_problem.samples - n_model, 1))
        ),
        residuals=tuple(point.e),
        fitted=tuple(m.outputs - e for m, e in zip(maneuvers, point.e, strict=True)),
        residual_kind="innovation",
        noise_covariance=problem.output_problem.residual_covariance([e.T for e in point.e]),
        iterations=found.iterations,
        converged=found.converged,
        warnings=tuple(warnings),
        details={
            "last_step_bounds": float(found.step),
            "cost": point.cost,
            "hac_inflation": factor,
            "process_deviation": np.exp(theta[n_model:n_noise]),
            "noise_deviation": np.exp(theta[n_noise:]),
            **maneuver_influence(objective.parts, objective.scores, covariance),
        },
    )
    return compare_noise_models(result, maneuvers, first) if compare_noise else result


def _started(
    problem: InnovationProblem, start: Array | None, noise: Array | None
) -> tuple[Array, Array]:
    """Return where output error begins, and where the filter does."""
    if noise is None:
        return _first_guess(problem, start)
    first = start_values(problem.output_problem) if start is None else start
    return first, np.concatenate([first, noise])


def _inflation(
    problem: InnovationProblem, found: GaussNewtonResult[InnovationLikelihood], covariance: Array
) -> Array:
    """Return the factors of standard errors by the autocorrelation of the scores."""
    point, steps_s = found.trial, [m.dt_s for m in problem.maneuvers]
    white = [point.whitened(k, point.as_filtered(k)) for k in range(len(steps_s))]
    return hac_inflation(problem.whitened_slopes(found.theta, point), white, steps_s, covariance)


def near_its_optimum(result: FitResult) -> bool:
    """Return whether a search has ended, or creeps by far less than its intervals."""
    last = float(np.max(result.details["last_step_bounds"]))
    return _near(last, converged=result.converged)


def _near(last_bounds: float, *, converged: bool) -> bool:
    return converged or last_bounds < NEAR_BOUNDS


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
    return problem.total(theta, *problem.scoring(theta, point))[0]


def _driven(model: LinearModel) -> tuple[str, ...]:
    """Return the states that process noise drives where nobody says which."""
    if has_equations(model):
        return model.process_noise
    rows = {t.row for t in model.terms if t.matrix == "A"}
    return tuple(model.states[i] for i in sorted(rows))


def _first_guess(problem: InnovationProblem, start: Array | None) -> tuple[Array, Array]:
    """Return where output error begins, and its estimate with its residuals split between both
    kinds of noise."""
    outputs, model = problem.output_problem, problem.model
    if has_equations(model):
        fitted = fit_output_error(
            model, problem.maneuvers, coloured_noise=False, start=start, multiple_starts=False
        )
        problem.set_steps(fitted.standard_error)
        first = estimate = fitted.estimate
        model, residuals = fitted.model, [r.T for r in fitted.residuals]
    else:
        first = start_values(outputs) if start is None else np.asarray(start, dtype=np.float64)
        optimum = minimise(outputs, first, max_iterations=15 if start is None else 0)
        estimate, residuals = optimum.theta, optimum.residuals
    A, _, C, _ = model.matrices(estimate)
    deviation = outputs.residual_deviation(residuals)
    return first, np.concatenate([estimate, first_noise(A, C, problem.process_index, deviation)])
