"""Slopes and Fisher information of a filter whose outputs are measured at some samples only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.sysid.numerics.filter_problem import FilterProblem, SteadyStateFilter
from host.sysid.numerics.filter_sensitivities import GainSensitivities
from host.sysid.numerics.intermittent_filter import (
    FilterEquations,
    IntermittentInnovations,
    filter_intermittent,
)


def intermittent_scoring(
    problem: FilterProblem,
    theta: Array,
    number: int,
    steady: SteadyStateFilter,
    by: GainSensitivities,
) -> tuple[Array, Array]:
    """Return information and negative gradient of a maneuver with missing outputs.

    Of an innovation w of variance s, given those before, the information is dw dw / s + ds ds /
    (2 s^2).

    Parameters
    ----------
    problem, theta, number, steady, by
        As for `intermittent_slopes`.

    Returns
    -------
    Array, shape (P, P)
    Array, shape (P,)

    Raises
    ------
    IdentificationError
        If the filter fails.
    """
    run, columns = intermittent_slopes(problem, theta, number, steady, by)
    white = run.white.ravel()
    spread = run.by_variance.reshape(white.size, -1)
    shared = columns[: spread.shape[1]]
    information, gradient = np.zeros((len(theta), len(theta))), np.zeros(len(theta))
    information[np.ix_(columns, columns)] = run.information
    information[np.ix_(shared, shared)] += 0.5 * spread.T @ spread
    gradient[columns] = -(run.by_independent.reshape(white.size, -1).T @ white)
    gradient[shared] -= 0.5 * spread.T @ (1.0 - white**2)
    return information, gradient


def intermittent_slopes(
    problem: FilterProblem,
    theta: Array,
    number: int,
    steady: SteadyStateFilter,
    by: GainSensitivities,
) -> tuple[IntermittentInnovations, IntArray]:
    """Return innovations of a maneuver with slopes, and which unknowns these are by.

    Parameters
    ----------
    problem : FilterProblem
    theta : Array, shape (P,)
    number : int
        Of the maneuver.
    steady : SteadyStateFilter
        At its sample period: the covariance it begins with.
    by : GainSensitivities
        Of that filter.

    Raises
    ------
    IdentificationError
        If the filter fails.
    """
    run = intermittent_innovations(problem, theta, number, steady, by)
    if run is None:  # it ran at this very point without slopes
        raise IdentificationError(f"model {problem.model.name}: the Kalman filter has no slopes")
    outputs, active = problem.output_problem, problem.columns(number)
    return run, active[_states_last(outputs.n_common, outputs.n_local, len(active))]


def intermittent_innovations(
    problem: FilterProblem,
    theta: Array,
    number: int,
    steady: SteadyStateFilter,
    by: GainSensitivities | None = None,
) -> IntermittentInnovations | None:
    """Run the filter of `intermittent_filter` over a maneuver with slopes; None if it fails.

    They are by the unknowns of `intermittent_slopes`; without `by` by its constants alone.
    """
    outputs, model = problem.output_problem, problem.sampled(number, theta)
    _, power = problem.noise(theta)
    equations = FilterEquations.of_known_noise(model, steady.Q, power, steady.P)
    if by is None:
        columns = outputs.n_common + np.arange(outputs.n_local)
    else:
        columns = _states_last(outputs.n_common, outputs.n_local, model.by_start.shape[1])
        Q_slopes, P_slopes = (np.ascontiguousarray(x.transpose(1, 2, 0)) for x in (by.Q, by.P))
        equations = replace(equations, Q_slopes=Q_slopes, P_slopes=P_slopes)
    equations = replace(equations, model=model.by(columns))
    return filter_intermittent(equations, outputs.drive(number), problem.maneuvers[number])


def _states_last(common: int, local: int, width: int) -> IntArray:
    """Return the unknowns of a maneuver, its own constants last: they move its states alone."""
    constants = common + np.arange(local)
    return np.concatenate([np.arange(common), np.arange(common + local, width), constants])
