"""Restricted likelihood of filter error: the constants of every maneuver integrated out.

Biases and initial states are fitted to each. Slow noise looks like them and goes into them, so that
what is left seems quicker than it is, and the aircraft slower: on flights of an independent
simulator, gusts of 1 m/s that roll the air, the lag of these was 17 % quick and L_p 7 % small, now
5 and 2.5. The restricted cost has half the log determinant of the constants' information beside it
(EQUATIONS.md, eq. 38). Innovations are linear in the constants, so that this needs no value
of the data: only the filter, how long a maneuver is, and which samples were measured.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.filter_problem import (
    FilterProblem,
    SteadyStateFilter,
    steady_state_filter,
)
from host.sysid.numerics.information_inverse import LEAST_IDENTIFIED
from host.sysid.numerics.intermittent_scoring import intermittent_innovations

STEP_BOUNDS = 0.01  # of a Cramer-Rao bound: differences
LOG_STEP = 1e-3  # of a logarithm of a deviation, at most: noise that is not there has any bound


def restricted_slopes(problem: FilterProblem, theta: Array, bounds: Array) -> Array:
    """Return the slopes of `half_log_determinants` by all unknowns, (maneuvers, P).

    Zero for a maneuver whose constants cannot be told apart.

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
    here = half_log_determinants(problem, theta)
    slopes = np.zeros((len(here), len(theta)))
    for k, name in enumerate(problem.names):
        if name in in_filter and bounds[k] > 0.0:
            step, moved = STEP_BOUNDS * bounds[k], theta.copy()
            moved[k] += step if k < problem.n_model else min(step, LOG_STEP)
            slopes[:, k] = (half_log_determinants(problem, moved) - here) / (moved[k] - theta[k])
    return np.where(np.isfinite(slopes), slopes, 0.0)


def half_log_determinants(problem: FilterProblem, theta: Array) -> Array:
    """Return half the log determinant of the information on the constants, (maneuvers,).

    NaN where the filter fails or constants cannot be told apart.
    """
    model = problem.model
    A, _, C, _ = model.matrices(theta)
    intensity, power = problem.noise(theta)
    found: list[float] = []
    responses: dict[float, _ConstantsResponse] = {}
    known: dict[tuple[float, int], float] = {}
    for number, maneuver in enumerate(problem.maneuvers):
        period_s, samples = problem.periods_s[number], maneuver.samples
        if period_s not in responses:
            gain = steady_state_filter(A, C, intensity, np.diag(power), period_s)
            if gain is None:
                return np.full(len(problem.maneuvers), np.nan)
            responses[period_s] = _ConstantsResponse(model, A, C, gain, period_s)
        response = responses[period_s]
        if maneuver.held:
            run = intermittent_innovations(problem, theta, number, response.gain)
            found.append(np.nan if run is None else _half_log_determinant(run.information))
            continue
        if (period_s, samples) not in known:
            known[period_s, samples] = response.half_log_determinant(samples)
        found.append(known[period_s, samples])
    return np.array(found)


def _half_log_determinant(information: Array) -> float:
    scale = np.sqrt(np.diag(information))
    if not np.all(scale > 0.0):
        return np.nan
    values = np.linalg.eigvalsh(information / np.outer(scale, scale))
    if not values[0] > LEAST_IDENTIFIED * values[-1]:
        return np.nan
    return float(np.sum(np.log(scale)) + 0.5 * np.sum(np.log(values)))


class _ConstantsResponse:
    """Whitened innovations as a linear system that the constants start."""

    def __init__(
        self, model: LinearModel, A: Array, C: Array, gain: SteadyStateFilter, dt_s: float
    ) -> None:
        n, p = len(A), len(C)
        rates = np.eye(n)[:, [model.states.index(s) for s in model.state_biases]]
        places = np.eye(p)[:, [model.outputs.index(y) for y in model.output_biases]]
        starts = np.eye(n)[:, [model.states.index(s) for s in model.initial_states]]
        none = np.zeros(0, dtype=np.int64)
        AB = np.hstack([A, rates, np.zeros((n, 1))])
        step, _ = discretise(AB, n, rates.shape[1], False, dt_s, none, none, none, np.zeros(0), 0)
        FK = gain.F @ gain.K
        biases = rates.shape[1] + places.shape[1]
        size = n + biases
        transition = np.eye(size)
        transition[:n, :n] = gain.F - FK @ C
        transition[:n, n:] = np.hstack([step[:, n:-1], -FK @ places])
        output = gain.whitener @ np.hstack([C, np.zeros((p, rates.shape[1])), places])
        start = np.zeros((size, biases + starts.shape[1]))
        start[n:, :biases] = np.eye(biases)
        start[:n, biases:] = starts
        self.gain = gain
        self._start = start
        self._powers = [(output.T @ output, transition)]

    def half_log_determinant(self, samples: int) -> float:
        """Return half the log determinant of the constants' information in so many samples."""
        information = self._start.T @ self._information(samples) @ self._start
        return _half_log_determinant(information)

    def _information(self, samples: int) -> Array:
        """Return the sum of squares of the outputs, by doubling the number of samples."""
        size = len(self._powers[0][1])
        total, so_far = np.zeros((size, size)), np.eye(size)
        for k in range(samples.bit_length()):
            if k == len(self._powers):
                part, over = self._powers[-1]
                self._powers.append((part + over.T @ part @ over, over @ over))
            part, over = self._powers[k]
            if samples >> k & 1:
                total = total + so_far.T @ part @ so_far
                so_far = over @ so_far
        return total
