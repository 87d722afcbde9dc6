"""Search for non-dimensional derivatives and sensor errors of one flight.

Force, moment and kinematic equations of all maneuvers are compared in the frequency domain
(equation error; Klein & Morelli, Aircraft System Identification, ch. 5 and 7). Their coefficients
and the sensor errors are estimated together by Gauss-Newton steps; the prior of the sensor errors
is the uncertainty in aircraft file and calibration. Instrumental variables from a gust-free
simulation (`auxiliary_model`) keep gusts and sensor noise from biasing the estimate. The weight of
each equation comes from the spectrum of its own residuals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel
from host.instrument.error_list import CONSIDERED, error_kinds
from host.instrument.error_sources import errors_by_file
from host.sysid.coefficients.auxiliary_model import simulate_noise_free
from host.sysid.coefficients.coefficient_fit import CoefficientFit
from host.sysid.coefficients.coefficient_intervals import (
    SearchResult,
    coefficient_fit,
    derivatives_of,
    intervals,
    validation,
)
from host.sysid.coefficients.coefficient_problem import (
    EquationData,
    FlightProblem,
    SensorErrorSlopes,
    flight_problem,
    mean_levels,
    sensor_error_slopes,
)
from host.sysid.coefficients.deletion_diagnostics import FinalStep
from host.sysid.coefficients.equation_blocks import (
    EquationSpectra,
    Unknowns,
    accumulate,
    equation_blocks,
)
from host.sysid.coefficients.flight_terms import SIDE
from host.sysid.coefficients.normal_equations import Prior, solve_normal_equations
from host.sysid.coefficients.trim_derivatives import DerivativesAtTrim
from host.sysid.coefficients.vertical_gust import vertical_gust_mps
from host.sysid.coefficients.window_spectra import ResidualSpectra, Window, residual_spectra
from host.sysid.models.coefficient_model import CoefficientModel, standard_model
from host.sysid.reconstruction.inverse_sensor_model import decimate, usable_length

# Rounds with the coefficients alone, then with sensor errors.
COEFFICIENT_ROUNDS, JOINT_ROUNDS = 3, 2
FIXED = 1e30  # inverse variance of what is not estimated, or not yet
COLUMNS = (
    "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
    "phi_rad", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad", "throttle", "qbar_pa",
    "density_kgpm3", "static_pa",
)  # fmt: skip


def search_coefficients(
    columns: Mapping[str, Array],
    windows: Sequence[Window],
    airframe: AirframeData,
    sensors: SensorErrorModel,
    powerplant: Powerplant,
    model: CoefficientModel | None = None,
    assumed: Mapping[str, float] | None = None,
    known_noise: ResidualSpectra | None = None,
) -> SearchResult:
    """Find the coefficients of lift, drag, side force and moments.

    Parameters
    ----------
    columns : mapping
        SI columns (n,) on an even grid as decoded, not moved to the CG; airborne throughout.
    windows : sequence of Window
        Maneuvers; of every axis that the model has equations of (`flight_terms`).
    airframe, sensors, powerplant
        Numbers of the aircraft file.
    model : CoefficientModel, optional
        The terms of every coefficient; `standard_model` by default.
    assumed : mapping, optional
        Standard deviations of errors that are larger than the instrument's.
    known_noise : ResidualSpectra, optional
        Spectra of residuals that are known of other flights, in place of those of this one. So is
        their air: what instrumental variables move is then the rows' noise, and widens nothing.

    Returns
    -------
    SearchResult

    Raises
    ------
    IdentificationError
        If a column or an axis is missing, the search meets an unstable aircraft, or a term cannot
        be separated from others at all.
    """
    missing = [c for c in ("t_s", *COLUMNS) if c not in columns]
    if missing:
        raise IdentificationError(f"coefficients need the columns {', '.join(missing)}")
    model = model or standard_model()
    flown = {w.longitudinal for w in windows}
    if flown != {name not in SIDE for name in model.equations}:
        raise IdentificationError(
            "coefficients need maneuvers of the elevator for lift, drag and pitch, of aileron and"
            " rudder for the others"
        )
    t = columns["t_s"]
    kept = usable_length(len(t))
    late = max(w.last_s for w in windows) > t[kept - 1]
    shift = len(t) - kept if late else 0
    taken = [*COLUMNS, *(k for k in ("thrust_n",) if k in columns)]
    cut = {k: np.ascontiguousarray(columns[k][shift : shift + kept]) for k in taken}
    t = t[shift : shift + kept]
    record = decimate(cut, float(t[-1] - t[0]) / (kept - 1))
    t = t[0] + np.arange(record.samples) * record.dt_s
    sources = errors_by_file(sensors, airframe, assumed)
    problem = flight_problem(model, record, t, windows, airframe, sensors, powerplant, sources)
    return _search(problem, known_noise or {})


def fit_coefficients(
    columns: Mapping[str, Array],
    windows: Sequence[Window],
    airframe: AirframeData,
    sensors: SensorErrorModel,
    powerplant: Powerplant,
    model: CoefficientModel | None = None,
) -> CoefficientFit:
    """Return coefficients with intervals and prediction; arguments of `search_coefficients`."""
    found = search_coefficients(columns, windows, airframe, sensors, powerplant, model)
    return coefficient_fit(found, intervals(found), validation(found))


@dataclass(slots=True)
class _Iterate:
    """The current iterate of the search.

    Attributes
    ----------
    theta, errors : Array
        Coefficients and sensor errors.
    noise : dict
        Frequency (Hz) and residual spectrum by equation.
    slopes : tuple of dict
        Derivatives of the residuals by the sensor errors, of the flight and of the gust-free one.
    level_slopes : Array, shape (3, errors)
    """

    theta: Array
    errors: Array
    noise: ResidualSpectra
    slopes: tuple[SensorErrorSlopes, SensorErrorSlopes]
    level_slopes: Array

    def coefficients(self, problem: FlightProblem) -> dict[str, Array]:
        """Return the coefficients by equation."""
        return {name: self.theta[at] for name, at in problem.positions.items()}


def _search(problem: FlightProblem, known_noise: ResidualSpectra) -> SearchResult:
    """Run all rounds."""
    position, sd = problem.position, problem.error_deviations
    iterate = _Iterate(
        np.zeros(len(position)), np.zeros(len(sd)), known_noise, ({}, {}),
        np.zeros((3, len(sd))),
    )  # fmt: skip
    known = problem.error_names  # of servos and clock only where the flight has such errors
    listed = [n for n, kind in error_kinds().items() if kind.coefficients == CONSIDERED]
    considered = np.array([known.index(n) for n in listed if n in known])
    by_round: list[Array] = []
    for round_ in range(COEFFICIENT_ROUNDS + JOINT_ROUNDS):
        data, spectra = _linearise(problem, iterate, round_)
        unknowns = Unknowns(problem.positions, len(position), len(sd))
        blocks = equation_blocks(
            problem.windows, *spectra, iterate.coefficients(problem), unknowns, iterate.noise
        )
        inverse_variance = np.full(len(sd), FIXED)
        if round_ >= COEFFICIENT_ROUNDS:
            inverse_variance = sd**-2.0
            inverse_variance[considered] = FIXED
        solution = solve_normal_equations(
            accumulate(blocks, unknowns.count),
            _prior(problem, data, unknowns, iterate, inverse_variance),
            position,
            unknowns.coefficients + considered,
            sd[considered],
        )
        final = FinalStep(blocks, solution, unknowns, iterate.noise, data.spectra)
        iterate.theta = iterate.theta + solution.step[: unknowns.coefficients]
        by_round.append(iterate.theta)
        iterate.errors = iterate.errors + solution.step[unknowns.coefficients :]
        residuals = (
            ((block.equation, block.window), block.residual_after(solution.step))
            for block in blocks
        )
        iterate.noise = {
            **residual_spectra(problem.windows, residuals, iterate.noise), **known_noise
        }  # fmt: skip
    # Each error is held to be zero with its deviation: what it truly is pulls by its prior alone,
    # whatever noise the data have.
    prior_weight = np.divide(inverse_variance, 1.0 / sd, out=np.zeros_like(sd), where=sd > 0.0)
    shifts = -final.solution.inverse[:, final.unknowns.coefficients :] * prior_weight
    moved = by_round[COEFFICIENT_ROUNDS - 1] - by_round[0]  # both without sensor errors
    if known_noise:
        moved = np.zeros_like(moved)
    return SearchResult(
        problem, iterate.theta, iterate.errors, iterate.level_slopes, final, shifts, moved
    )


def _linearise(
    problem: FlightProblem, iterate: _Iterate, round_: int
) -> tuple[EquationData, tuple[EquationSpectra, EquationSpectra]]:
    """Return the equations at the iterate, then spectra of the flight and of the gust-free one."""
    flight = problem.record, problem.history
    data = noise_free_data = problem.evaluate(*flight, iterate.errors)
    if round_ > 0:
        at_trim = derivatives_of(problem, data, iterate.theta)
        noise_free = simulate_noise_free(
            problem.record,
            data.signals,
            problem.history,
            _value_of(at_trim),
            problem.airframe,
            problem.sensors,
            problem.condition,
            _whole_axes(problem.model),
        )
        noise_free_data = problem.evaluate(*noise_free, iterate.errors)
        if round_ == COEFFICIENT_ROUNDS:
            own = iterate.coefficients(problem)
            first, iterate.level_slopes = sensor_error_slopes(
                problem, *flight, data, own, iterate.errors
            )
            second, _ = sensor_error_slopes(
                problem, *noise_free, noise_free_data, own, iterate.errors
            )
            iterate.slopes = first, second
    return data, (
        EquationSpectra(data.spectra, iterate.slopes[0]),
        EquationSpectra(noise_free_data.spectra, iterate.slopes[1]),
    )


def _whole_axes(model: CoefficientModel) -> tuple[bool, bool]:
    """Return whether all equations are there that the motion of each axis is made of."""
    along = {model.forces[0], "Cm"} <= model.equations.keys()
    return along, set(SIDE) <= model.equations.keys()


def _value_of(at_trim: DerivativesAtTrim) -> Callable[[str], float]:
    """Return derivatives by name, 0 of those that no term contributes to."""
    return lambda name: at_trim[name][0] if name in at_trim else 0.0


def _prior(
    problem: FlightProblem,
    data: EquationData,
    unknowns: Unknowns,
    iterate: _Iterate,
    inverse_variance: Array,
) -> Prior:
    """Return the prior of sensor errors and of the tangential balance of the flight."""
    information, gradient = np.zeros((unknowns.count,) * 2), np.zeros(unknowns.count)
    first = unknowns.coefficients
    information[first:, first:] = np.diag(inverse_variance)
    gradient[first:] = -inverse_variance * iterate.errors
    # Without elevator maneuvers the side equation stands for the vertical one.
    rate = iterate.noise.get("w", iterate.noise.get("v"))
    if iterate.slopes[0] and rate is not None:
        gust_mps = vertical_gust_mps(rate[1], problem.condition[0], problem.record.dt_s)
        deviation_mps2 = problem.balance_deviation_mps2(gust_mps)
        balance = iterate.level_slopes[0] / deviation_mps2
        information[first:, first:] += np.outer(balance, balance)
        gradient[first:] -= balance * (mean_levels(problem, data)[0] / deviation_mps2)
    return Prior(information, gradient)
