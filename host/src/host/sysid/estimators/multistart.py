"""Multistart: search from several starts where the first may have led to a local minimum.

Differentiated noise biases equation error where noise is large and motion fast. If the first search
does not converge, leaves more than the sensors' own noise or than no model would, or ends where the
information is nearly singular, further searches start from `homotopy_start`. If those do not help,
more start from equation error on signals behind a state variable filter, then with simulated
instruments.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.homotopy import homotopy_start
from host.sysid.estimators.regression import (
    RegressionEquation,
    regression_equations,
    solve_least_squares,
)
from host.sysid.models.collinearity import CONDITION_LIMIT
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.output_error import Optimum, minimise
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.recursion import simulate
from host.sysid.numerics.white_noise import noise_deviation

HOMOTOPY_GAINS_RADPS = ((2.0, 0.5), (6.0, 1.5, 0.4))  # falling feedback gains, one search each
CORNERS_RADPS = (0.5, 2.0, 6.0, 20.0)  # of the filter: slow to fast motion of small aircraft
INSTRUMENT_CORNERS_RADPS = (2.0, 6.0)
INSTRUMENT_ROUNDS = 3
FILTER_TIME_CONSTANTS = 3.0  # length of the transient that is cut off
EXCESS_POWER = 2.0  # residual over white-noise power: above it other starts are tried
MOST_STARTS = 4  # further searches
LAST_SEARCH_ITERATIONS = 200  # where none of them has converged
LEAST_SAMPLES = 50


def multistart(
    problem: OutputProblem, theta: Array, *, multiple_starts: bool = True, restarts: bool = True
) -> Optimum:
    """Return the best optimum of white-noise output error found from `theta` and other starts.

    For equations of a user it is the one that is reached from `theta`.

    Parameters
    ----------
    problem : OutputProblem
    theta : Array, shape (P,)
        Start.
    multiple_starts : bool
        Try other starts if the optimum leaves more than white noise or its information is nearly
        singular (default). In a flight gusts leave more than noise at every optimum.
    restarts : bool
        Try other starts if the search does not converge or its end explains nothing (default);
        otherwise its end stands.

    Raises
    ------
    IdentificationError
        If no start is finite over the maneuvers.
    """
    if has_equations(problem.model):
        return minimise(problem, theta, max_iterations=LAST_SEARCH_ITERATIONS)
    if not restarts:
        return minimise(problem, theta)
    best, failure = _try(problem, None, theta)
    found = best is not None and best.converged and _explains_motion(problem, best)
    if best is not None and found and not multiple_starts:
        return best
    accepted = best is not None and best.converged and _residuals_are_noise(problem, best)
    if best is not None and accepted and not _nearly_singular(best):
        return best
    best = _from_other_starts(problem, theta, best)
    if best is None:
        assert failure is not None
        raise failure
    if not best.converged:
        best = minimise(problem, best.theta, max_iterations=LAST_SEARCH_ITERATIONS)
    return best


def _from_other_starts(
    problem: OutputProblem, theta: Array, best: Optimum | None
) -> Optimum | None:
    """Return the best of `best` and searches from other starts, as many as are needed."""
    for rates_radps in HOMOTOPY_GAINS_RADPS:
        try:
            homotopy_theta = homotopy_start(problem, theta, rates_radps)
        except IdentificationError:
            continue
        best, _ = _try(problem, best, homotopy_theta)
    known = best if best is not None and best.converged else None
    if known is None or not _residuals_are_noise(problem, known):
        for start in _starts(problem, theta, known)[:MOST_STARTS]:
            best, _ = _try(problem, best, start)
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
    """Return whether the information is close to singular; minima are then shallow and several."""
    information = optimum.information[np.ix_(optimum.free, optimum.free)]
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values = np.linalg.eigvalsh(information / np.outer(scale, scale))
    return bool(values[-1] > CONDITION_LIMIT * max(values[0], 1e-300))


def white_cost(problem: OutputProblem, theta: Array) -> float:
    """Return the concentrated cost of white noise as `minimise` defines it."""
    outputs = problem.outputs(theta)
    if outputs is None:
        return np.inf
    with np.errstate(over="ignore"):
        squares = np.sum(
            [np.sum(problem.residual(k, y) ** 2, axis=1) for k, y in enumerate(outputs)], axis=0
        )
    if not np.isfinite(squares).all():
        return np.inf
    prior = problem.prior_precision * (theta - problem.prior_mean) ** 2
    power = np.maximum(squares / problem.counts, 1e-300)
    return 0.5 * (float(np.sum(problem.counts * np.log(power))) + float(np.sum(prior)))


def _residuals_are_noise(problem: OutputProblem, optimum: Optimum) -> bool:
    noise = noise_deviation(problem.maneuvers) ** 2
    power = np.mean(np.hstack(optimum.residuals) ** 2, axis=1)
    return bool(np.all(power <= EXCESS_POWER * noise))


def _explains_motion(problem: OutputProblem, optimum: Optimum) -> bool:
    """Return whether an optimum leaves less than a constant for each output and maneuver does.

    Equation error of short noisy inputs may start at an aircraft that diverges: its growing motion
    has so much information that a search ends where it began.
    """
    left, moved = np.zeros((2, len(problem.counts)))
    for number, residual in enumerate(optimum.residuals):
        for j, y in enumerate(problem.measured(number)):
            seen = problem.seen(number, j)
            measured = y if seen is None else y[seen]
            left[j] += float(np.sum(residual[j] ** 2))
            moved[j] += float(np.sum((measured - np.mean(measured)) ** 2))
    # An output that stands still, or is met without error, has no power.
    shares = np.maximum(left, 1e-300) / np.maximum(moved, 1e-300)
    return float(np.sum(problem.counts * np.log(shares))) < 0.0


def _starts(problem: OutputProblem, theta: Array, accepted: Optimum | None) -> list[Array]:
    """Return other starts, that of the least cost first.

    There are none if a state is not measured, or if an accepted optimum has a lower cost than each.
    """
    try:
        problem.model.measured_states()
    except IdentificationError:
        return []
    found: list[tuple[float, Array]] = []
    for corner in CORNERS_RADPS:
        _add(found, problem, _filtered_equation_error(problem, corner, None))
    if accepted is not None and all(cost >= accepted.cost for cost, _ in found):
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
    """Solve equation error on filtered signals, with a simulated response as instruments if given.

    State variable filter: Garnier & Wang (eds.), Identification of Continuous-time Models from
    Sampled Data, 2008.
    """
    model = problem.model
    try:
        lagged = [_state_variable_filter(model, m, corner_radps) for m in problem.maneuvers]
        names, equations = regression_equations(model, lagged)
        if simulated is None:
            estimate = solve_least_squares(equations, len(names))
        else:
            instrument = [
                _state_variable_filter(model, replace(m, outputs=y.T), corner_radps)
                for m, y in zip(problem.maneuvers, simulated, strict=True)
            ]
            _, instruments = regression_equations(model, instrument)
            estimate = _instrumental_variables(equations, instruments, len(names))
    except (IdentificationError, np.linalg.LinAlgError):
        return None
    theta = problem.first_guess()
    place = {name: k for k, name in enumerate(problem.names)}
    for name, value in zip(names, estimate, strict=True):
        theta[place[name]] = value
    return theta


def _instrumental_variables(
    equations: list[RegressionEquation], instruments: list[RegressionEquation], count: int
) -> Array:
    """Solve (Z'X) theta = Z'z with instruments Z (Ljung, 2nd ed., sec. 7.6)."""
    normal, right = np.zeros((count, count)), np.zeros(count)
    for row, instrument in zip(equations, instruments, strict=True):
        normal += instrument.regressors.T @ row.regressors
        right += instrument.regressors.T @ row.dependent
    scale = np.sqrt(np.maximum(np.abs(np.diag(normal)), 1e-300))
    return np.asarray(np.linalg.solve(normal / np.outer(scale, scale), right / scale) / scale)


def _state_variable_filter(model: LinearModel, maneuver: Maneuver, corner_radps: float) -> Maneuver:
    """Filter all signals by corner / (s + corner); rates of the filtered states are then exact."""
    pole = float(np.exp(-corner_radps * maneuver.dt_s))
    transient = round(FILTER_TIME_CONSTANTS / (corner_radps * maneuver.dt_s))
    if maneuver.samples - transient < LEAST_SAMPLES:
        raise IdentificationError(f"{maneuver.name}: too short for a lag of {corner_radps} rad/s")
    outputs = _first_order_lag(maneuver.outputs, pole, held=False)
    inputs = _first_order_lag(maneuver.inputs, pole, held=model.hold == "zoh")
    measured = model.measured_states()
    return Maneuver(
        maneuver.dt_s,
        inputs[transient:],
        outputs[transient:],
        rates=corner_radps * (maneuver.outputs - outputs)[transient:, measured],
        name=maneuver.name,
    )


def _first_order_lag(values: Array, pole: float, *, held: bool) -> Array:
    """Filter columns by a first-order lag from rest, linear between samples unless held."""
    held_input = values if held else 0.5 * (values + np.vstack([values[1:], values[-1:]]))
    columns = values.shape[1]
    step = np.hstack([pole * np.eye(columns), np.eye(columns)])
    _, z = simulate(step, np.ascontiguousarray((1.0 - pole) * held_input), np.zeros(columns))
    return z[:, :columns]
