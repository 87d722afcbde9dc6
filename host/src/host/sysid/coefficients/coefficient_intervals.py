"""Build the final coefficient fit: geometric prior, intervals, maneuver agreement."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from host.arrays import Array
from host.sysid.coefficients.aero_equations import KINEMATIC
from host.sysid.coefficients.coefficient_fit import (
    CoefficientFit,
    CoefficientHistory,
    Derivative,
    MeanCondition,
    ThrustEffect,
    coefficient_history,
    derivatives_with_intervals,
)
from host.sysid.coefficients.coefficient_problem import (
    EquationData,
    FlightProblem,
    alpha_range,
    density,
    mean_force_regressors,
    mean_levels,
    regressor_rms,
)
from host.sysid.coefficients.deletion_diagnostics import (
    CrossValidation,
    FinalStep,
    cross_validation,
    maneuver_influence,
)
from host.sysid.coefficients.geometry_prior import apply_geometry_prior
from host.sysid.coefficients.trim_derivatives import (
    DerivativesAtTrim,
    TrimMeans,
    derivatives_at_trim,
    zero_lift_drag,
)
from host.sysid.models.uncertainty import Uncertainty, consider_covariance
from host.sysid.numerics.maneuver_agreement import ManeuverAgreement, scatter_test

# One deviation of the error that instrumental variables leave, as a share of what they moved. A
# roll rate follows the aileron so closely that they are weak: on fourteen flights of an independent
# simulator whose air rolls at 0.5 and 1 m/s Cl_p is 0.08 to 0.24 of the truth by least squares, and
# 0.65 to 0.99 by them. In light turbulence they move it by 7 %.
MOVED_SHARE = 0.25
LEAST_MOVED = 0.3  # of a coefficient: below, air neither pitches nor rolls
MOVED_BY_AIR = ("Cm_alpha", "Cm_q", "Cl_p", "Cl_da", "Cn_beta", "Cn_r")


@dataclass(frozen=True)
class SearchResult:
    """Result of the search.

    Attributes
    ----------
    problem : FlightProblem
    theta : Array, shape (coefficients,)
    errors : Array, shape (errors,)
        Estimated sensor errors.
    level_slopes : Array, shape (3, errors)
        Derivatives of `mean_levels` by the sensor errors.
    final : FinalStep
    error_shifts : Array, shape (n, errors)
        Shift of all unknowns by one standard deviation of each sensor error.
    moved_from_least_squares : Array, shape (coefficients,)
        How far instrumental variables moved each estimate from that of least squares: next to
        nothing where air neither pitches nor rolls.
    """

    problem: FlightProblem
    theta: Array
    errors: Array
    level_slopes: Array
    final: FinalStep
    error_shifts: Array
    moved_from_least_squares: Array

    @cached_property
    def data(self) -> EquationData:
        """The equations at the estimated sensor errors."""
        return self.problem.evaluate(self.problem.record, self.problem.history, self.errors)

    @property
    def covariance(self) -> Array:
        """Covariance of all unknowns, (n, n).

        A share of what instrumental variables moved much counts.
        """
        own = self.final.solution.covariance
        if not self.least_squares_shares:
            return own
        left = np.zeros(len(own))
        left[: len(self.theta)] = MOVED_SHARE * self.moved_from_least_squares
        return own + consider_covariance(left[None])

    @property
    def least_squares_shares(self) -> dict[str, float]:
        """Coefficients that instrumental variables moved much: least squares over the estimate."""
        shares = {
            name: float(self.moved_from_least_squares[k] / self.theta[k])
            for name, k in self.problem.position.items()
            if name in MOVED_BY_AIR
        }
        return {name: 1.0 - moved for name, moved in shares.items() if abs(moved) > LEAST_MOVED}


def derivatives_of(
    problem: FlightProblem,
    data: EquationData,
    state: Array,
    level_slopes: Array | None = None,
    *,
    nuisance: bool = False,
) -> DerivativesAtTrim:
    """Return the derivatives at the mean condition of a flight, with their slopes.

    Parameters
    ----------
    problem : FlightProblem
    data : EquationData
    state : Array, shape (n,)
        All unknowns, sensor errors last.
    level_slopes : Array, shape (3, errors), optional
        Slopes of `mean_levels`; without them CL and CD count as exact.
    nuisance : bool
        Return derivatives of nuisance terms too.
    """
    _, drag, lift = mean_levels(problem, data)
    slopes = np.zeros((3, len(state)))
    if level_slopes is not None:
        slopes[:, -level_slopes.shape[1] :] = level_slopes
    means = TrimMeans(problem.condition[2], lift, drag, slopes[2], slopes[1])
    return derivatives_at_trim(problem.model, state, problem.position, means, nuisance=nuisance)


@dataclass(frozen=True, slots=True)
class CoefficientIntervals:
    """Derivatives with their intervals, sensor errors, and their joint covariance.

    Attributes
    ----------
    state : Array, shape (n,)
        Estimate with the geometric prior.
    derivatives : tuple of Derivative
    errors : dict
        Sensor error to its estimate and standard deviation.
    covariance : Array, shape (derivatives + errors, derivatives + errors)
    maneuver_agreement : ManeuverAgreement
        Scatter of the maneuvers about the joint estimate.
    error_shifts : dict of str to (derivatives,) Array
        Shift of the derivatives by one standard deviation of each error of sensors and of the
        drawing.
    """

    state: Array
    derivatives: tuple[Derivative, ...]
    errors: dict[str, tuple[float, float]]
    covariance: Array
    maneuver_agreement: ManeuverAgreement
    error_shifts: dict[str, Array]


def intervals(search: SearchResult) -> CoefficientIntervals:
    """Apply the geometric prior, add drag at zero lift, test the agreement of the maneuvers."""
    problem, final, level_slopes = search.problem, search.final, search.level_slopes
    data, position = search.data, problem.position
    state = np.concatenate([search.theta, search.errors])
    state, covariance, gain_complement, arm_shifts = apply_geometry_prior(
        state,
        search.covariance,
        derivatives_of(problem, data, state, nuisance=True),
        problem.airframe,
    )
    found = derivatives_of(problem, data, state, level_slopes)
    _, drag, lift = mean_levels(problem, data)
    if "CL_alpha" in found and "CD_alpha" in found:
        means = TrimMeans(problem.condition[2], lift, drag, level_slopes[2], level_slopes[1])
        regressor_means = mean_force_regressors(problem, data)
        found["CD_0"] = zero_lift_drag(
            problem.model, state, position, means, regressor_means, found
        )
    values = {name: value for name, (value, _) in found.items()}
    errors = slice(final.unknowns.coefficients, None)
    jacobian = np.vstack([*(slope for _, slope in found.values()), np.eye(len(state))[errors]])
    joint = jacobian @ covariance @ jacobian.T
    agreement = scatter_test(
        tuple(values),
        *maneuver_influence(final, problem.windows, jacobian[: len(values)] @ gain_complement),
    )
    known = Uncertainty(joint, np.full(len(joint), np.inf))
    joint = known.with_model_error([agreement.in_normal_quantiles]).covariance
    updated = (gain_complement @ search.error_shifts).T
    state_shifts = dict(zip(problem.error_names, updated, strict=True)) | arm_shifts
    shifts = {name: jacobian[: len(values)] @ shift for name, shift in state_shifts.items()}
    deviations = np.sqrt(np.maximum(np.diag(covariance)[errors], 0.0))
    pairs = zip(state[errors].tolist(), deviations.tolist(), strict=True)
    return CoefficientIntervals(
        state,
        derivatives_with_intervals(
            values, joint[: len(values), : len(values)], regressor_rms(problem, data)
        ),
        dict(zip(problem.error_names, pairs, strict=True)),
        joint,
        agreement,
        shifts,
    )


def validation(search: SearchResult) -> CrossValidation | None:
    """Return how each maneuver is predicted by all others; None if none can be left out."""
    return cross_validation(search.final, search.problem.windows)


def coefficient_fit(
    search: SearchResult, widths: CoefficientIntervals, predicted: CrossValidation | None
) -> CoefficientFit:
    """Return the parts of all stages as one result."""
    problem, data = search.problem, search.data
    _, drag, lift = mean_levels(problem, data)
    return CoefficientFit(
        derivatives=widths.derivatives,
        covariance=widths.covariance,
        errors=widths.errors,
        condition=MeanCondition(
            *problem.condition,
            lift,
            drag,
            _thrust_effect(problem),
            alpha_range(problem, data),
            problem.airspeed_ratio,
        ),
        histories=_histories(problem, data, widths.state),
        prediction=predicted,
        maneuver_agreement=widths.maneuver_agreement,
        error_sources=problem.sources,
        error_shifts=widths.error_shifts,
    )


def _thrust_effect(problem: FlightProblem) -> ThrustEffect:
    """Return thrust, its slope and its arm at the mean condition of the flight.

    The rotor settles within 0.1 s, ten times faster than the phugoid: held at its speed it would
    damp that twice as much.
    """
    plant, history, record = problem.powerplant, problem.history, problem.record
    thrust = float(np.mean(history.thrust_n))
    driving = (record.columns["throttle"], history.axial_mps, density(record))
    by_speed, _ = plant.settled_slopes(*(float(x[problem.window_samples].mean()) for x in driving))
    arm_m = plant.hub_m[2] * plant.axis[0] - plant.hub_m[0] * plant.axis[2]
    return ThrustEffect(thrust, by_speed, float(arm_m))


def _histories(
    problem: FlightProblem, data: EquationData, state: Array
) -> dict[str, CoefficientHistory]:
    """Return every force and moment coefficient in time, measured and modelled."""
    found = {}
    for name, equation in data.equations.items():
        if name in KINEMATIC:
            continue
        model = np.zeros_like(equation.response)
        terms = zip(problem.positions[name], equation.regressors.values(), strict=True)
        for index, regressor in terms:
            model += state[index] * regressor
        windows = [w.positions for w in problem.windows if name in w.equations]
        found[name] = coefficient_history(equation.response, model, windows)
    return found
