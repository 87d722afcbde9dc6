"""Search from several starts where the first one may have led into a wrong valley.

Differentiated noise draws equation error far off where the noise is large and the motion fast.
Where the first search ends without convergence, leaves more than the sensors' own noise or ends in
a nearly flat valley, others start where a model that follows the measured states leads
(`following`). Where those do not settle it, more start from equation error on filtered signals:
states, inputs and rates pass one lag, whose derivative needs no differentiation (state variable
filter; Garnier & Wang (eds.), Identification of Continuous-time Models from Sampled Data, 2008),
then with the simulated response as instruments.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.estimators.homotopy import homotopy_start
from host.sysid.estimators.kalman import noise_deviation
from host.sysid.estimators.regression import (
    RegressionEquation,
    regression_equations,
    solve_least_squares,
)
from host.sysid.identification_error import IdentificationError
from host.sysid.models.diagnostics import CONDITION_LIMIT
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.output_error import Optimum, minimise
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.recursion import simulate

HOMOTOPY_GAINS_RADPS = ((2.0, 0.5), (6.0, 1.5, 0.4))  # rates of following, one search each
CORNERS_RADPS = (0.5, 2.0, 6.0, 20.0)  # of the lag: slow and fast motions of small aircraft
INSTRUMENT_CORNERS_RADPS = (2.0, 6.0)
INSTRUMENT_ROUNDS = 3
FILTER_TIME_CONSTANTS = 3.0  # time constants until the lag has forgotten its start
EXCESS_POWER = 2.0  # residual over white noise power: from here on the fit is looked at again
MOST_STARTS = 4  # searches from other starts
LAST_SEARCH_ITERATIONS = 200  # iterations where none of them has converged
LEAST_SAMPLES = 50


def multistart(problem: OutputProblem, theta: Array, *, multiple_starts: bool = True) -> Optimum:
    """Return the best optimum of white-noise output error found from `theta` and other starts.

    Parameters
    ----------
    problem : OutputProblem
    theta : Array, shape (P,)
        Start.
    multiple_starts : bool
        Look further from an optimum that leaves more than white noise or lies in a flat valley
        (default). In a flight the gusts leave more than noise at every optimum.

    Raises
    ------
    IdentificationError
        If no start is finite over the maneuvers.
    """
    best, failure = _try(problem, None, theta)
    if best is not None and best.converged and not multiple_starts:
        return best
    settled = best is not None and best.converged and _residuals_are_noise(problem, best)
    if best is not None and settled and not _nearly_singular(best):
        return best
    for rates_radps in HOMOTOPY_GAINS_RADPS:
        try:
            led = homotopy_start(problem, theta, rates_radps)
        except IdentificationError:
            continue
        best, _ = _try(problem, best, led)
    settled = best is not None and best.converged and _residuals_are_noise(problem, best)
    if not settled:
        known = best if best is not None and best.converged else None
        for start in _starts(problem, theta, known)[:MOST_STARTS]:
            best, _ = _try(problem, best, start)
    if best is None:
        assert failure is not None
        raise failure
    if not best.converged:
        best = minimise(problem, best.theta, max_iterations=LAST_SEARCH_ITERATIONS)
    return best


def _try(
    problem: OutputProblem, best: Optimum | None, start: Array
) -> tuple[Optimum | None, IdentificationError | None]:
    """Return the better of `best` and a search from `start`, and why that search failed."""
    try:
        found = minimise(problem, start)
    except IdentificationError as error:
        return best, error
    return (found if best is None or found.cost < best.cost else best), None


def _nearly_singular(optimum: Optimum) -> bool:
    """Whether the information is close to singular: valleys are long there, and many."""
    information = optimum.information[np.ix_(optimum.free, optimum.free)]
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values = np.linalg.eigvalsh(information / np.outer(scale, scale))
    return bool(values[-1] > CONDITION_LIMIT * max(values[0], 1e-300))


def white_cost(problem: OutputProblem, theta: Array) -> float:
    """Return the concentrated likelihood of white noise as `minimise` counts it."""
    outputs = problem.outputs(theta)
    if outputs is None:
        return np.inf
    with np.errstate(over="ignore"):
        squares = np.sum(
            [np.sum((problem.measured(k) - y) ** 2, axis=1) for k, y in enumerate(outputs)], axis=0
        )
    if not np.isfinite(squares).all():
        return np.inf
    prior = problem.prior_precision * (theta - problem.prior_mean) ** 2
    power = np.maximum(squares / problem.samples, 1e-300)
    return 0.5 * (problem.samples * float(np.sum(np.log(power))) + float(np.sum(prior)))


def _residuals_are_noise(problem: OutputProblem, optimum: Optimum) -> bool:
    noise = noise_deviation(problem.maneuvers) ** 2
    power = np.mean(np.hstack(optimum.residuals) ** 2, axis=1)
    return bool(np.all(power <= EXCESS_POWER * noise))


def _starts(problem: OutputProblem, theta: Array, settled: Optimum | None) -> list[Array]:
    """Return other starts, the deepest first; none where a state is not seen.

    Nor where a search has settled and none of them begins deeper than that.
    """
    try:
        problem.model.measured_states()
    except IdentificationError:
        return []
    found: list[tuple[float, Array]] = []
    for corner in CORNERS_RADPS:
        _add(found, problem, _filtered_equation_error(problem, corner, None))
    if settled is not None and all(cost >= settled.cost for cost, _ in found):
        return []
    first = white_cost(problem, theta)
    for _ in range(INSTRUMENT_ROUNDS):
        found.sort(key=lambda pair: pair[0])
        source = found[0][1] if found and found[0][0] < first else theta
        outputs = problem.outputs(source)
        if outputs is None:
            break
        for corner in INSTRUMENT_CORNERS_RADPS:
            _add(found, problem, _filtered_equation_error(problem, corner, outputs))
    return [start for cost, start in sorted(found, key=lambda pair: pair[0]) if np.isfinite(cost)]


def _add(found: list[tuple[float, Array]], problem: OutputProblem, start: Array | None) -> None:
    if start is not None:
        start = np.clip(start, problem.lower, problem.upper)
        found.append((white_cost(problem, start), start))


def _filtered_equation_error(
    problem: OutputProblem, corner_radps: float, simulated: list[Array] | None
) -> Array | None:
    """Solve equation error on lagged signals, with a simulated response as instruments."""
    model = problem.model
    try:
        lagged = [_state_variable_filter(model, m, corner_radps) for m in problem.maneuvers]
        names, rows = regression_equations(model, lagged)
        if simulated is None:
            estimate = solve_least_squares(rows, len(names))
        else:
            calm = [
                _state_variable_filter(model, replace(m, outputs=y.T), corner_radps)
                for m, y in zip(problem.maneuvers, simulated, strict=True)
            ]
            _, instruments = regression_equations(model, calm)
            estimate = _instrumental_variables(rows, instruments, len(names))
    except (IdentificationError, np.linalg.LinAlgError):
        return None
    theta = problem.first_guess()
    place = {name: k for k, name in enumerate(problem.names)}
    for name, value in zip(names, estimate, strict=True):
        theta[place[name]] = value
    return theta


def _instrumental_variables(
    rows: list[RegressionEquation], instruments: list[RegressionEquation], count: int
) -> Array:
    normal, right = np.zeros((count, count)), np.zeros(count)
    for row, calm in zip(rows, instruments, strict=True):
        normal += calm.regressors.T @ row.regressors
        right += calm.regressors.T @ row.target
    scale = np.sqrt(np.maximum(np.abs(np.diag(normal)), 1e-300))
    return np.asarray(np.linalg.solve(normal / np.outer(scale, scale), right / scale) / scale)


def _state_variable_filter(model: LinearModel, maneuver: Maneuver, corner_radps: float) -> Maneuver:
    """Pass everything through corner / (s + corner); rates of the lagged states are exact."""
    keep = float(np.exp(-corner_radps * maneuver.dt_s))
    skip = round(FILTER_TIME_CONSTANTS / (corner_radps * maneuver.dt_s))
    if maneuver.samples - skip < LEAST_SAMPLES:
        raise IdentificationError(f"{maneuver.name}: too short for a lag of {corner_radps} rad/s")
    outputs = _first_order_lag(maneuver.outputs, keep, held=False)
    inputs = _first_order_lag(maneuver.inputs, keep, held=model.hold == "zoh")
    seen = model.measured_states()
    return Maneuver(
        maneuver.dt_s,
        inputs[skip:],
        outputs[skip:],
        rates=corner_radps * (maneuver.outputs - outputs)[skip:, seen],
        name=maneuver.name,
    )


def _first_order_lag(values: Array, keep: float, *, held: bool) -> Array:
    """Pass columns through a lag from rest; they run linearly between samples unless held."""
    following = values if held else 0.5 * (values + np.vstack([values[1:], values[-1:]]))
    columns = values.shape[1]
    step = np.hstack([keep * np.eye(columns), np.eye(columns)])
    _, z = simulate(step, np.ascontiguousarray((1.0 - keep) * following), np.zeros(columns))
    return z[:, :columns]
