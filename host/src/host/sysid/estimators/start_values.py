"""Start values from the cheaper methods: equation error first, the model's own numbers else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.estimators.regression import regression_equations, solve_least_squares
from host.sysid.identification_error import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.output_error_problem import OutputProblem


def start_values(problem: OutputProblem) -> Array:
    """Return the whole start vector of an output-error search.

    Equation error gives the common parameters and rate biases where every state is measured and
    the result does not diverge over the maneuver; the model's start values stand in otherwise.
    """
    theta = problem.first_guess()
    told = regression_estimates(problem.model, problem.maneuvers)
    better = np.array([told.get(name, x) for name, x in zip(problem.names, theta, strict=True)])
    better = np.asarray(np.clip(better, problem.lower, problem.upper), dtype=np.float64)
    if problem.outputs(better) is None:
        return theta
    return better


def regression_estimates(model: LinearModel, maneuvers: Sequence[Maneuver]) -> dict[str, float]:
    """Return what equation error says of a model's parameters and biases, by name.

    Places of accelerometers and delays enter no regression; they are left out, and all the rest is
    told as if they were zero. Nothing is told where a state is not measured or two are collinear.
    """
    places = {lever.parameter for lever in model.accelerometer_offsets}
    plain = replace(
        model,
        accelerometer_offsets=(),
        delays=(),
        parameters=tuple(p for p in model.parameters if p.name not in places),
    )
    try:
        names, rows = regression_equations(plain, maneuvers)
        estimate = solve_least_squares(rows, len(names))
    except IdentificationError:
        return {}
    return dict(zip(names, estimate.tolist(), strict=True))


def start_values_of(model: LinearModel, maneuvers: Sequence[Maneuver]) -> Array:
    """Return `start_values` of a model and its maneuvers."""
    return start_values(OutputProblem(model, maneuvers))
