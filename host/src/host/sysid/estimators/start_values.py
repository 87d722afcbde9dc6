"""Start values of a search: from equation error, else the model's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.regression import regression_equations, solve_least_squares
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.model_problems import output_problem
from host.sysid.numerics.output_error_problem import OutputProblem


def start_values(problem: OutputProblem) -> Array:
    """Return the whole start vector of an output-error search.

    Equation error gives the common parameters and rate biases if every state is measured and the
    simulation with them does not diverge; otherwise, and of equations of a user, the model's start
    values are used.
    """
    theta = problem.first_guess()
    if has_equations(problem.model):
        return np.asarray(np.clip(theta, problem.lower, problem.upper), dtype=np.float64)
    estimates = regression_estimates(problem.model, problem.maneuvers)
    better = np.array(
        [estimates.get(name, x) for name, x in zip(problem.names, theta, strict=True)]
    )
    better = np.asarray(np.clip(better, problem.lower, problem.upper), dtype=np.float64)
    if problem.outputs(better) is None:
        return theta
    return better


def regression_estimates(model: LinearModel, maneuvers: Sequence[Maneuver]) -> dict[str, float]:
    """Return equation-error estimates of a model's parameters and biases, by name.

    Accelerometer offsets and delays enter no regression; they are left out as if they were zero.
    The result is empty if a state is not measured or regressors are collinear.
    """
    places = {lever.parameter for lever in model.accelerometer_offsets}
    without_offsets = replace(
        model,
        accelerometer_offsets=(),
        delays=(),
        parameters=tuple(p for p in model.parameters if p.name not in places),
    )
    try:
        names, rows = regression_equations(without_offsets, maneuvers)
        estimate = solve_least_squares(rows, len(names))
    except IdentificationError:
        return {}
    return dict(zip(names, estimate.tolist(), strict=True))


def start_values_of(model: LinearModel, maneuvers: Sequence[Maneuver]) -> Array:
    """Return `start_values` of a model and its maneuvers."""
    return start_values(output_problem(model, maneuvers))
