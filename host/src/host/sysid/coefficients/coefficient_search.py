"""Non-dimensional derivatives straight from flight, with every stated uncertainty in the interval.

Force, moment and kinematic equations of all maneuvers are compared in the frequency domain, their
coefficients and the errors of the instrument found together (Gauss-Newton; the errors have the
aircraft file's and the calibration's uncertainty as prior). Left factors are gust-free
(`gust_free`), so neither gusts nor sensor noise bias the answer; the weight of each equation comes
from its own residuals. Klein & Morelli, Aircraft System Identification, ch. 5 and 7, for equation
error in the frequency domain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.instrument.deviations import SensorErrorModel, deviations
from host.sysid.coefficients.auxiliary_model import gust_free
from host.sysid.coefficients.coefficient_fit import CoefficientFit
from host.sysid.coefficients.coefficient_intervals import (
    Searched,
    coefficient_fit,
    intervals,
    local,
    validation,
)
from host.sysid.coefficients.coefficient_model import CoefficientModel, standard_model
from host.sysid.coefficients.coefficient_problem import (
    FlightProblem,
    Rows,
    Slopes,
    mean_levels,
    moved_by_errors,
    prepared,
)
from host.sysid.coefficients.deletion_diagnostics import LastStep
from host.sysid.coefficients.equation_blocks import Side, Unknowns, stretches, summed
from host.sysid.coefficients.normal_equations import Known, stepped
from host.sysid.coefficients.slow_gusts import gust_information, gust_strength, turned
from host.sysid.coefficients.trim_derivatives import Local
from host.sysid.coefficients.window_spectra import Window, noise_spectra
from host.sysid.compatibility.inverse_sensor_model import decimate, usable_length
from host.sysid.identification_error import IdentificationError

PLAIN_ROUNDS, FULL_ROUNDS = 3, 2  # without errors of the instrument and slow gusts, with them
# Not estimated, only carried into the intervals: a vane's lag of 0.5 ms looks like an arm of 8 mm,
# and estimating the arm drew CL_de 15 % and CY_beta 11 % off (simulated flights, seeds 300-303).
# Pitot and density stay as calibrated too: the flight tells them no better than that, and what it
# seems to tell drew CL_alpha 0.5 % and CD_0 off (seeds 900-939).
CONSIDERED = (
    "cg_x_m", "imu_x_m", "ixx_share", "iyy_share", "izz_share",
    "pitot_scale", "pitot_drift_pa", "density_share",
)  # fmt: skip
HELD = 1e30  # inverse variance of what is not estimated, or not yet
COLUMNS = (
    "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
    "phi_rad", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad", "throttle", "qbar_pa",
    "density_kgpm3", "static_pa",
)  # fmt: skip


def search_coefficients(
    columns: Mapping[str, Array],
    windows: Sequence[Window],
    airframe: AirframeData,
    data: SensorErrorModel,
    plant: Powerplant,
    model: CoefficientModel | None = None,
) -> Searched:
    """Find the coefficients of lift, drag, side force and moments.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid as decoded, not moved to the CG; airborne throughout.
    windows : sequence of Window
        Maneuvers; at least one with the elevator and one with aileron and rudder.
    airframe, data, plant
        Of the aircraft file.
    model : CoefficientModel, optional
        The terms of every coefficient; `standard_model` by default.

    Raises
    ------
    IdentificationError
        If a column or an axis is missing, the search meets an unstable aircraft, or a term cannot
        be told from others at all.
    """
    missing = [c for c in ("t_s", *COLUMNS) if c not in columns]
    if missing:
        raise IdentificationError(f"coefficients need the columns {', '.join(missing)}")
    if not any(w.longitudinal for w in windows) or all(w.longitudinal for w in windows):
        raise IdentificationError(
            "coefficients need maneuvers of the elevator and of aileron and rudder"
        )
    t = columns["t_s"]
    kept = usable_length(len(t))
    late = max(w.last_s for w in windows) > t[kept - 1]
    shift = len(t) - kept if late else 0
    cut = {k: np.ascontiguousarray(columns[k][shift : shift + kept]) for k in COLUMNS}
    t = t[shift : shift + kept]
    record = decimate(cut, float(t[-1] - t[0]) / (kept - 1))
    t = t[0] + np.arange(record.samples) * record.dt_s
    prior = deviations(data, airframe)
    names = tuple(prior)
    problem = prepared(model or standard_model(), record, t, windows, airframe, data, plant, names)
    return _search(problem, np.array(list(prior.values())))


def fit_coefficients(
    columns: Mapping[str, Array],
    windows: Sequence[Window],
    airframe: AirframeData,
    data: SensorErrorModel,
    plant: Powerplant,
    model: CoefficientModel | None = None,
) -> CoefficientFit:
    """Return coefficients with intervals and prediction; arguments of `search_coefficients`."""
    found = search_coefficients(columns, windows, airframe, data, plant, model)
    return coefficient_fit(found, intervals(found), validation(found))


@dataclass(slots=True)
class _State:
    """Where the search stands: coefficients, errors of the instrument, spectra of the residuals;
    how residuals of the flight and of the gust-free one, and mean levels, move with the errors."""

    theta: Array
    errors: Array
    noise: dict[str, tuple[Array, Array]]
    slopes: tuple[Slopes, Slopes]
    levels: Array

    def own(self, problem: FlightProblem) -> dict[str, Array]:
        """Return the coefficients of each equation."""
        return {row: self.theta[at] for row, at in problem.places.items()}


def _search(problem: FlightProblem, sd: Array) -> Searched:
    """Return coefficients and errors of the instrument, known to `sd` before."""
    position = problem.position
    state = _State(np.zeros(len(position)), np.zeros(len(sd)), {}, ({}, {}), np.zeros((3, len(sd))))
    considered = np.array([problem.names.index(n) for n in CONSIDERED])
    for round_ in range(PLAIN_ROUNDS + FULL_ROUNDS):
        rows, sides = _sides(problem, state, sd, round_)
        gusts = sum(values.shape[1] for values in sides[0].gusts.values())
        unknowns = Unknowns(problem.places, len(position), gusts, len(sd))
        parts = stretches(problem.blocks, *sides, state.own(problem), unknowns, state.noise)
        inverse_variance = np.full(len(sd), HELD)
        if round_ >= PLAIN_ROUNDS:
            inverse_variance = sd**-2.0
            inverse_variance[considered] = HELD
        solved = stepped(
            summed(parts, unknowns.count),
            _known(problem, rows, unknowns, state, inverse_variance),
            position,
            unknowns.first_error + considered,
            sd[considered],
        )
        last = LastStep(parts, solved, unknowns, state.noise, rows.spectra)
        state.theta = state.theta + solved.step[: unknowns.terms]
        state.errors = state.errors + solved.step[unknowns.first_error :]
        left_over = (((part.name, part.window), part.left(solved.step)) for part in parts)
        state.noise = noise_spectra(problem.blocks, left_over, state.noise)
    return Searched(problem, state.theta, state.errors, state.levels, last)


def _sides(
    problem: FlightProblem, state: _State, sd: Array, round_: int
) -> tuple[Rows, tuple[Side, Side]]:
    """Return the equations where the search stands, then flight and gust-free flight."""
    flown = problem.record, problem.flown
    rows = left = problem.rows(*flown, state.errors)
    if round_ > 0:
        found = local(problem, rows, state.theta)
        calm = gust_free(
            problem.record, rows.signals, problem.flown, _reader(found),
            problem.airframe, problem.data, problem.condition,
        )  # fmt: skip
        left = problem.rows(*calm, state.errors)
        if round_ == PLAIN_ROUNDS:
            own = state.own(problem)
            first, state.levels = moved_by_errors(problem, *flown, rows, own, state.errors, sd)
            state.slopes = first, moved_by_errors(problem, *calm, left, own, state.errors, sd)[0]
    return rows, (_side(problem, rows, state.slopes[0]), _side(problem, left, state.slopes[1]))


def _side(problem: FlightProblem, rows: Rows, slopes: Slopes) -> Side:
    """Return what rows are made of; slow gusts come with the errors of the instrument."""
    return Side(rows.spectra, turned(rows.signals, problem.blocks) if slopes else {}, slopes)


def _reader(found: Local) -> Callable[[str], float]:
    """Return slopes by name, 0 where no term makes one."""
    return lambda name: found[name][0] if name in found else 0.0


def _known(
    problem: FlightProblem,
    rows: Rows,
    unknowns: Unknowns,
    state: _State,
    inverse_variance: Array,
) -> Known:
    """Return what is known of errors, slow gusts and the balance of the flight before the step."""
    information, pull = np.zeros((unknowns.count,) * 2), np.zeros(unknowns.count)
    first = unknowns.first_error
    information[first:, first:] = np.diag(inverse_variance)
    pull[first:] = -inverse_variance * state.errors
    if unknowns.gusts:
        V, dt_s = problem.condition[0], problem.record.dt_s
        strength = gust_strength(state.noise, V, dt_s)
        gusts = slice(unknowns.terms, first)
        information[gusts, gusts] = gust_information(problem.blocks, strength, V, dt_s)
        within_mps2 = problem.balance_mps2(strength["w"])
        balance = state.levels[0] / within_mps2
        information[first:, first:] += np.outer(balance, balance)
        pull[first:] -= balance * (mean_levels(problem, rows)[0] / within_mps2)
    return Known(information, pull)
