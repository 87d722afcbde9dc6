"""From where a search ended to a fit: intervals with geometry in them, validation, both in one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from host.arrays import Array
from host.sysid.coefficients.aero_equations import KINEMATIC
from host.sysid.coefficients.coefficient_fit import (
    CoefficientFit,
    Derivative,
    Flight,
    Pull,
    Trace,
    derivatives,
    trace,
)
from host.sysid.coefficients.coefficient_problem import (
    FlightProblem,
    Rows,
    density,
    flown_range,
    force_means,
    mean_levels,
    regressor_sizes,
)
from host.sysid.coefficients.deletion_diagnostics import LastStep, Prediction, prediction, pulls
from host.sysid.coefficients.geometry_prior import apply_geometry_prior
from host.sysid.coefficients.trim_derivatives import Local, Mean, local_derivatives, zero_lift_drag
from host.sysid.numerics.maneuver_agreement import ManeuverAgreement, agreement_of


@dataclass(frozen=True)
class Searched:
    """Coefficients and errors of the instrument found; how mean levels move with the errors."""

    problem: FlightProblem
    theta: Array
    errors: Array
    levels: Array
    last: LastStep

    @cached_property
    def rows(self) -> Rows:
        """The equations at the errors found."""
        return self.problem.rows(self.problem.record, self.problem.flown, self.errors)


def local(problem: FlightProblem, rows: Rows, state: Array, levels: Array | None = None) -> Local:
    """Return told terms and what follows from them: value, slope with the state."""
    _, drag, lift = mean_levels(problem, rows)
    moved = np.zeros((3, len(state)))
    if levels is not None:
        moved[:, -levels.shape[1] :] = levels
    mean = Mean(problem.condition[2], lift, drag, moved[2], moved[1])
    return local_derivatives(problem.model, state, problem.position, mean)


@dataclass(frozen=True, slots=True)
class CoefficientIntervals:
    """Derivatives with their intervals, the errors of the instrument, and their joint covariance.

    `state` is the estimate once the airframe's drawing is counted in; `repeats` is how single
    maneuvers scatter about it.
    """

    state: Array
    derivatives: tuple[Derivative, ...]
    errors: dict[str, tuple[float, float]]
    covariance: Array
    repeats: ManeuverAgreement


def intervals(ended: Searched) -> CoefficientIntervals:
    """Add what geometry says, drag at zero lift, and what maneuvers scatter beyond chance."""
    problem, last, levels = ended.problem, ended.last, ended.levels
    rows, position = ended.rows, problem.position
    state = np.concatenate([ended.theta, np.zeros(last.unknowns.gusts), ended.errors])
    before = local(problem, rows, state)
    state, covariance, kept = apply_geometry_prior(
        state, last.solved.covariance, before, problem.airframe
    )
    found = local(problem, rows, state, levels)
    _, drag, lift = mean_levels(problem, rows)
    if "CL_alpha" in found and "CD_alpha" in found:
        mean = Mean(problem.condition[2], lift, drag, levels[2], levels[1])
        means = force_means(problem, rows)
        found["CD_0"] = zero_lift_drag(problem.model, state, position, mean, means, found)
    values = {name: value for name, (value, _) in found.items()}
    errors = slice(last.unknowns.first_error, None)
    slopes = np.vstack([*(slope for _, slope in found.values()), np.eye(len(state))[errors]])
    own = slopes @ covariance @ slopes.T
    agreement = agreement_of(
        tuple(values), *pulls(last, problem.blocks, slopes[: len(values)] @ kept)
    )
    own[np.diag_indices(len(values))] += agreement.extra_variance
    left = np.sqrt(np.maximum(np.diag(covariance)[errors], 0.0))
    pairs = zip(state[errors].tolist(), left.tolist(), strict=True)
    return CoefficientIntervals(
        state,
        derivatives(values, own[: len(values), : len(values)], regressor_sizes(problem, rows)),
        dict(zip(problem.names, pairs, strict=True)),
        own,
        agreement,
    )


def validation(ended: Searched) -> Prediction | None:
    """Return how well each maneuver is predicted by all others; None where none can be."""
    return prediction(ended.last, ended.problem.blocks)


def coefficient_fit(
    ended: Searched, widths: CoefficientIntervals, predicted: Prediction | None
) -> CoefficientFit:
    """Return the parts of all stages as one fit."""
    problem, rows = ended.problem, ended.rows
    _, drag, lift = mean_levels(problem, rows)
    flight = Flight(
        *problem.condition, lift, drag, _pull(problem), flown_range(problem, rows), problem.faster
    )
    return CoefficientFit(
        widths.derivatives,
        widths.covariance,
        widths.errors,
        flight,
        _traces(problem, rows, widths.state),
        predicted,
        widths.repeats,
    )


def _pull(problem: FlightProblem) -> Pull:
    """Return what thrust does on the mean of the flight."""
    plant, flown = problem.plant, problem.flown
    spin, thrust = (float(np.mean(x)) for x in (flown.spin_radps, flown.thrust_n))
    air = float(np.mean(density(problem.record)))
    arm_m = plant.hub_m[2] * plant.axis[0] - plant.hub_m[0] * plant.axis[2]
    return Pull(thrust, plant.slope(spin, problem.condition[0], air), float(arm_m))


def _traces(problem: FlightProblem, rows: Rows, state: Array) -> dict[str, Trace]:
    """Return every force and moment coefficient in time, measured and modelled."""
    found = {}
    for name, equation in rows.equations.items():
        if name in KINEMATIC:
            continue
        model = np.zeros_like(equation.left)
        for place, regressor in zip(problem.places[name], equation.terms.values(), strict=True):
            model += state[place] * regressor
        mine = [b.places for b in problem.blocks if name in b.names]
        found[name] = trace(equation.left, model, mine)
    return found
