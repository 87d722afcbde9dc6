"""Start values from the cheaper methods: equation error first, the model's own numbers else."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError
from host.sysid.estimators.rows import regression_rows, solve_rows
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import LinearModel
from host.sysid.numerics.problem import OutputProblem


def start_values(problem: OutputProblem) -> Array:
    """Return the whole start vector of an output-error search.

    Equation error gives the common parameters and rate biases where every state is measured and
    the result does not diverge over the maneuver; the model's start values stand in otherwise.
    """
    theta = problem.first_guess()
    try:
        names, rows = regression_rows(problem.model, problem.maneuvers)
        estimate = solve_rows(rows, len(names))
    except IdentificationError:
        return theta
    regressed = theta.copy()
    position = {name: k for k, name in enumerate(problem.names)}
    for name, value in zip(names, estimate, strict=True):
        regressed[position[name]] = value
    regressed = np.clip(regressed, problem.lower, problem.upper)
    if problem.outputs(regressed) is None:
        return theta
    return regressed


def start_values_of(model: LinearModel, maneuvers: Sequence[Maneuver]) -> Array:
    """Return `start_values` of a model and its maneuvers."""
    return start_values(OutputProblem(model, maneuvers))
