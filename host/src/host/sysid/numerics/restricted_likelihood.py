"""Restricted likelihood of filter error: the constants of every maneuver integrated out.

Biases and initial states are fitted to each. Slow noise looks like them and goes into them, so that
what is left seems quicker than it is. By how much that turns the slopes of the cost is known
beforehand and taken off (EQUATIONS.md, eq. 38; McCullagh & Tibshirani, J. R. Stat. Soc. B 52,
1990). Innovations are linear in the constants, so that this needs no value of the data: only the
filter, how long a maneuver is, and which samples were measured.

On flights of an independent simulator, gusts of 1 m/s that roll the air, the lag of these was 17 %
quick and L_p 7 % small without it. Only the noise counts: what constants do to the outputs depends
on the aircraft too, and with that in the slopes L_r and N_r had no correction at all.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.sysid.numerics.filter_problem import FilterProblem
from host.sysid.numerics.filtered_constants import FilterAt, FilterPair, filters_at
from host.sysid.numerics.information_inverse import LEAST_IDENTIFIED

STEP_BOUNDS = 0.01  # of a Cramer-Rao bound: differences
LOG_STEP = 1e-3  # of a logarithm of a deviation, at most: noise that is not there has any bound


def restricted_slopes(problem: FilterProblem, theta: Array, bounds: Array) -> Array:
    """Return what the fitted constants take from the slopes of the cost, (maneuvers, P).

    Half the slope of ln det (X' S^-1 X) by the covariance S of all noise of a maneuver; what its
    constants do to the outputs, X, stays as it is at `theta`. Zero where the constants of a
    maneuver cannot be separated.

    Parameters
    ----------
    problem : FilterProblem
    theta : Array, shape (P,)
    bounds : Array, shape (P,)
        Cramer-Rao bounds; an unknown whose bound is zero has no slope.
    """
    model = problem.model
    in_filter = {t.parameter for t in model.terms if t.matrix in "AC"}
    in_filter |= {x.parameter for x in model.accelerometer_offsets}
    in_filter |= set(problem.names[problem.n_model :])
    here = filters_at(problem, theta)
    slopes = np.zeros((len(problem.maneuvers), len(theta)))
    for k, name in enumerate(problem.names):
        if name in in_filter and bounds[k] > 0.0:
            step, moved = STEP_BOUNDS * bounds[k], theta.copy()
            moved[k] += step if k < problem.n_model else min(step, LOG_STEP)
            changes = _changes(problem, here, filters_at(problem, moved))
            slopes[:, k] = changes / (moved[k] - theta[k])
    return np.where(np.isfinite(slopes), slopes, 0.0)


def _changes(
    problem: FilterProblem, here: dict[float, FilterAt], there: dict[float, FilterAt]
) -> Array:
    """Return half the change of every maneuver's log determinant; NaN where it has none."""
    pairs = {
        dt_s: FilterPair(problem.model, here[dt_s], there[dt_s])
        for dt_s in here.keys() & there.keys()
    }
    found = []
    for dt_s, maneuver in zip(problem.periods_s, problem.maneuvers, strict=True):
        sums = pairs[dt_s].sums(maneuver) if dt_s in pairs else None
        found.append(np.nan if sums is None else _half_change(*sums))
    return np.array(found)


def _half_change(own: Array, change: Array) -> float:
    """Return half the change of ln det own where it becomes own + change + change'.

    To first order: tr(own^-1 change). NaN where constants cannot be separated, or there are none.
    """
    scale = np.sqrt(np.diag(own))
    if not (
        own.size and np.all(scale > 0.0) and np.isfinite(own).all() and np.isfinite(change).all()
    ):
        return np.nan
    sizes = np.outer(scale, scale)
    values = np.linalg.eigvalsh(own / sizes)
    if not values[0] > LEAST_IDENTIFIED * values[-1]:
        return np.nan
    return float(np.trace(np.linalg.solve(own / sizes, change / sizes)))
