"""Filter error of a user's equations: an extended Kalman filter's innovations, maximum likelihood.

As `filter_error` for linear models, with delays, priors, bounds and parameters of each record.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.compiled import has_compiler
from host.errors import IdentificationError
from host.extras import install_hint
from host.sysid.estimators.filter_error import MAX_ITERATIONS
from host.sysid.estimators.innovation_search import InnovationObjective, first_noise, noise_floor
from host.sysid.estimators.noise_model_comparison import compare_noise_models
from host.sysid.estimators.output_error_fit import fit_output_error
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.numerics.equation_filter_problem import (
    EquationFilterProblem,
    EquationLikelihood,
)
from host.sysid.numerics.gauss_newton import gauss_newton
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.maneuver_agreement import maneuver_influence

# As Python 2000 samples of four states take minutes a search.
SAMPLES_WITHOUT_COMPILER = 500


def fit_equation_filter_error(
    model: NonlinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: tuple[str, ...] | None = None,
    start: Array | None = None,
    compare_noise: bool = True,
) -> FitResult:
    """Fit by filter error.

    Parameters
    ----------
    model, maneuvers
        Model and data.
    process : tuple of str, optional
        States driven by white process noise; by default those of the model.
    start : Array, optional
        Start of the vector without noise parameters; by default from output error.
    compare_noise : bool
        Ask whether coloured measurement noise explains the data better.

    Raises
    ------
    IdentificationError
        If no start is finite, or there is no compiler for so many samples.
    """
    if not has_compiler() and sum(m.samples for m in maneuvers) > SAMPLES_WITHOUT_COMPILER:
        raise IdentificationError(
            f"filter error of equations takes hours without numba: {install_hint('numba')}"
        )
    problem = EquationFilterProblem(model, maneuvers, process or model.process_noise)
    first = fit_output_error(
        model, maneuvers, coloured_noise=False, start=start, multiple_starts=False
    )
    problem.set_steps(first.standard_error)
    outputs = problem.output_problem
    deviation = outputs.residual_deviation([r.T for r in first.residuals])
    A, _, C, _ = first.model.matrices(first.estimate)
    driven = first_noise(A, C, problem.process_index, deviation)
    theta = np.concatenate([first.estimate, driven])
    count = len(problem.process)
    floor = noise_floor(maneuvers, theta[problem.n_model : problem.n_model + count])
    objective = _EquationFilterError(problem, floor)
    found = gauss_newton(objective, theta, max_iterations=MAX_ITERATIONS)
    if found is None:
        raise IdentificationError(f"model {model.name}: the Kalman filter fails at the start")
    theta, point = found.theta, found.trial
    covariance = covariance_from_information(found.information)
    warnings: tuple[str, ...] = ()
    if not found.converged:
        warnings = (f"no convergence: last step {found.step:.3g} bounds long",)
    freedom = float(max(outputs.samples - problem.n_model, 1))
    result = FitResult(
        method="filter error",
        model=outputs.model_at(theta[: problem.n_model]),
        names=problem.names,
        estimate=theta,
        covariance=covariance,
        covariance_white=covariance,
        degrees_of_freedom=np.full(len(theta), freedom),
        residuals=tuple(point.e),
        fitted=tuple(m.outputs - e for m, e in zip(maneuvers, point.e, strict=True)),
        residual_kind="innovation",
        noise_covariance=outputs.residual_covariance([e.T for e in point.e]),
        iterations=found.iterations,
        converged=found.converged,
        warnings=warnings,
        details={
            "last_step_bounds": float(found.step),
            "cost": point.cost,
            "process_deviation": np.exp(theta[problem.n_model : problem.n_model + count]),
            "noise_deviation": np.exp(theta[problem.n_model + count :]),
            **maneuver_influence(objective.parts, objective.scores, covariance),
        },
    )
    if not compare_noise:
        return result
    return compare_noise_models(result, maneuvers, theta[: problem.n_model])


class _EquationFilterError(InnovationObjective[EquationLikelihood]):
    """Cost of the extended Kalman filter."""

    def __init__(self, problem: EquationFilterProblem, floor: Array) -> None:
        super().__init__(problem.output_problem, floor)
        self._problem = problem

    def evaluate(self, theta: Array) -> EquationLikelihood | None:
        return self._problem.evaluate(theta)

    def score(self, theta: Array, trial: EquationLikelihood) -> tuple[list[Array], list[Array]]:
        return self._problem.scoring(theta, trial)[:2]
