"""Sensitivity of an estimate to systematic sensor errors: one Gauss-Newton step for each.

One standard deviation of every uncorrected error changes the data and, through the trim, the model.
The shift of the estimate is one Gauss-Newton step of its own method, with the innovations of filter
error or the residuals of output error. No fit is repeated.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import Condition
from host.arrays import Array
from host.constants import POSTERIOR_PRIOR_RATIO
from host.instrument.deviations import unknown_sensors
from host.instrument.error_list import NOT_PAID, ZERO, error_kinds
from host.instrument.error_sources import ErrorSource, error_sources
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate, trim_of
from host.sysid.errors.one_step import OneStep, one_step_of
from host.sysid.estimators.gust_penetration import penetration_of, without_gust_penetration
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.rate_forces import by_prior, with_rate_forces
from host.sysid.models.reduced_model import without_inputs, without_outputs
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import TEMPLATES, WITHOUT_AIRSPEED, Trim, template
from host.sysid.models.uncertainty import Uncertainty, consider_covariance
from host.sysid.numerics.model_problems import output_problem
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.reconstruction.flight_path import PITOT
from host.sysid.reconstruction.reconstruction import Compatibility
from host.sysid.reconstruction.sensor_corrections import (
    INSTANTANEOUS_ERRORS,
    correct_columns,
    pressure_share,
    residual_deviations,
)
from host.sysid.reconstruction.sensor_dynamics import perturb_columns, residual_errors

RECONSTRUCTED = "reconstruction of this flight"  # that left less of an error than files state
# Most that a pitot's zero is moved by at once, as a share of the dynamic pressure: one that nobody
# zeroed is off by more than all of it, and no airspeed would be left. A larger one counts in
# proportion.
MOST_PRESSURE = 0.2
PITOT_ZERO = PITOT[1]
TRIMMING = ("airspeed_mps", "alpha_rad", "theta_rad", "qbar_pa", "density_kgpm3")


def systematic_error_shifts(
    result: FitResult,
    maneuvers: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    known: Sequence[Compatibility],
    trim: Trim,
) -> tuple[ShiftedEstimate, ...]:
    """Return the shift of the estimate for one standard deviation of each uncorrected sensor error.

    Parameters
    ----------
    result : FitResult
        With parameters about `trim` if its model is a template.
    maneuvers : sequence of Maneuver
        As fitted.
    cuts : sequence of mapping
        All columns of each maneuver.
    known : sequence of Compatibility
        Agreement of the flight of each maneuver. An error is one of all flights, in each of them by
        its own deviation there: what is new at every power-on counts as if it were not.
    trim : Trim

    Returns
    -------
    tuple of ShiftedEstimate
        Empty if the model diverges at the answer.
    """
    one_step = one_step_of(result, maneuvers, trim)
    if one_step is None:
        return ()
    shifted = []
    every = list(_without_each(result.model, maneuvers, cuts, known, trim))
    open_share = _open_zeros(one_step, result, maneuvers, trim, every)
    for one in every:
        estimate = result.estimate
        if not one.same(result.model, maneuvers):
            change = one_step.change(one.model, one.trim, one.maneuvers)
            size = open_share.get(one.error, 1.0) / one.part
            estimate = estimate + size * change.sum(axis=0)
        gains = (1.0 + (gain - 1.0) / one.part for gain in one.gains)
        shifted.append(ShiftedEstimate(one.error, estimate, *gains))
    return tuple(shifted)


def _open_zeros(
    one_step: OneStep,
    result: FitResult,
    maneuvers: Sequence[Maneuver],
    trim: Trim,
    every: Sequence[_WithoutOne],
) -> dict[str, float]:
    """Return what a record leaves open of the zeros of its sensors, in deviations.

    A constant error of a sensor shows in the record where the model has none of its own: of what
    it is not, nothing widens an interval. What it seems to be counts with its deviation, for it is
    not taken out. Without noise the zero of alpha alone makes intervals as wide as their values.
    """
    zeros = [
        one
        for one in every
        if error_kinds()[one.error].change == ZERO
        and one.error != PITOT_ZERO  # which moves the trim
        and not one.same(result.model, maneuvers)
    ]
    if not zeros:
        return {}
    wider = one_step.widened_in(result)
    step = one_step.joint(
        result.model,
        trim,
        maneuvers,
        [(one.model, one.maneuvers) for one in zeros],
        [1.0 / wider] * len(zeros),
    )
    left = np.hypot(step.added, wider * np.sqrt(np.diag(step.covariance)))
    known_zeros = zip(zeros, left, strict=True)
    return {one.error: float(size) for one, size in known_zeros if size < POSTERIOR_PRIOR_RATIO}


def systematic_residuals(
    problem: OutputProblem,
    theta: Array,
    cuts: Sequence[Mapping[str, Array]],
    known: Sequence[Compatibility],
    trim: Trim,
) -> list[Array]:
    """Return what one standard deviation of each uncorrected error does to a free simulation.

    Errors are those of the simulated outputs: a share of the measured ones would have their noise,
    by which it would be found in them.

    Parameters
    ----------
    problem : OutputProblem
        Problem of the maneuvers.
    theta : Array
    cuts, known, trim
        As `systematic_error_shifts`.

    Returns
    -------
    list of Array, shape (p, samples, errors)
        Shifts of each maneuver; those that change nothing, or with which the model diverges, are
        left out.
    """
    outputs = problem.outputs(theta)
    if outputs is None:
        return []
    names, model = problem.model.outputs, problem.model
    noise = [m.outputs - y.T for m, y in zip(problem.maneuvers, outputs, strict=True)]
    smooth = [replace(m, outputs=y.T) for m, y in zip(problem.maneuvers, outputs, strict=True)]
    still = [
        {**cut, **{name: cut[name] - left[:, j] for j, name in enumerate(names)}}
        for cut, left in zip(cuts, noise, strict=True)
    ]
    found: list[list[Array]] = [[] for _ in outputs]
    for one in _without_each(model, smooth, still, known, trim):
        if one.same(model, smooth):
            continue
        other = output_problem(one.model, one.maneuvers)
        there = outputs if one.simulates_the_same(model, smooth) else other.outputs(theta)
        for k, changes in enumerate(found):
            moved = 0.0 * outputs[k] if there is None else other.residual(k, there[k])
            changes.append(moved / one.part)
    moving = [k for k, changes in enumerate(zip(*found, strict=True)) if np.any(np.hstack(changes))]
    return [
        np.stack([changes[k] for k in moving], axis=-1) if moving else np.zeros((*y.shape, 0))
        for changes, y in zip(found, outputs, strict=True)
    ]


@dataclass(frozen=True, slots=True)
class _WithoutOne:
    """Model, trim and maneuvers without one standard deviation of an error, or a part of it."""

    error: str
    part: float
    gains: tuple[float, float]  # of airspeed and dynamic pressure
    model: LinearModel
    trim: Trim
    maneuvers: Sequence[Maneuver]

    def same(self, model: LinearModel, maneuvers: Sequence[Maneuver]) -> bool:
        """Return whether the error changes neither the model nor any of the maneuvers."""
        return self.model is model and all(map(operator.is_, self.maneuvers, maneuvers))

    def simulates_the_same(self, model: LinearModel, maneuvers: Sequence[Maneuver]) -> bool:
        """Return whether it changes nothing but what was measured."""
        return self.model is model and all(
            own.inputs is m.inputs and own.dt_s == m.dt_s
            for own, m in zip(self.maneuvers, maneuvers, strict=True)
        )


def _without_each(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    known: Sequence[Compatibility],
    trim: Trim,
) -> Iterator[_WithoutOne]:
    """Yield the data, and through the trim the model, without each uncorrected error."""
    still = _mean_of(cuts)
    flights = {id(c): (c, cut) for c, cut in zip(reversed(known), reversed(cuts), strict=True)}
    sizes = {
        key: {source.name: source.deviation for source in errors_left_open(*flight)}
        for key, flight in flights.items()
    }
    fresh = is_template(model, trim)
    for error in dict.fromkeys(e for c in known for e in sizes[id(c)]):
        part = 1.0
        if error == PITOT_ZERO:
            most = MOST_PRESSURE * max(still[1].qbar_pa, 1.0)
            part = min(1.0, most / max(s.get(error, 0.0) for s in sizes.values()))
        other = [
            _without_one(cut, error, part * sizes[id(c)].get(error, 0.0), c)
            for cut, c in zip(cuts, known, strict=True)
        ]
        changed = [_changed(model, m, c, o) for m, c, o in zip(maneuvers, cuts, other, strict=True)]
        there = _mean_of(other)
        gains = (
            there[1].airspeed_mps / still[1].airspeed_mps,
            there[1].qbar_pa / still[1].qbar_pa,
        )
        bent = _bent(trim, still[0], there[0]) if fresh and there[0] != still[0] else trim
        moved = model if bent is trim else retrimmed(model, bent)
        yield _WithoutOne(error, part, gains, moved, bent, changed)


def errors_left_open(known: Compatibility, columns: Mapping[str, Array]) -> tuple[ErrorSource, ...]:
    """Return the errors that the reconstruction of a flight leaves open, as linear models pay them.

    Parameters
    ----------
    known : Compatibility
        Agreement of the flight.
    columns : mapping
        Columns of a maneuver: the delay of vanes by an aircraft file depends on its airspeed.
    """
    left = {e: sd for e, sd in residual_deviations(known).items() if e in INSTANTANEOUS_ERRORS}
    sizes = left | residual_errors(known, columns)
    informed = {f.name: RECONSTRUCTED for f in known.findings if f.data_informed}
    listed = error_sources(sizes, known.instrument or unknown_sensors(), informed)
    return tuple(e for e in listed if e.deviation > 0.0 and e.kind.linear != NOT_PAID)


def _without_one(
    columns: Mapping[str, Array],
    error: str,
    deviation: float,
    known: Compatibility,
) -> dict[str, Array]:
    """Return columns with one standard deviation of an error removed."""
    if error in INSTANTANEOUS_ERRORS:
        return correct_columns(columns, {error: deviation}, pressure_share(known))
    return perturb_columns(columns, error, deviation, known)


def add_systematic_covariance(result: FitResult, moved: Sequence[ShiftedEstimate]) -> Uncertainty:
    """Return what is not known of a result, systematic errors added."""
    known = result.uncertainty
    if not moved:
        return known
    # What the fit left out stays out: no deviation of a sensor brings it back.
    fitted = known.variance > 0.0
    shifts = np.stack([np.where(fitted, m.estimate - result.estimate, 0.0) for m in moved])
    total = known.plus(consider_covariance(shifts))
    # Welch-Satterthwaite: what is carried is no small sample of maneuvers.
    own = known.variance / np.maximum(total.variance, 1e-300)
    freedom = known.degrees_of_freedom / np.maximum(own, 1e-6) ** 2
    return replace(total, degrees_of_freedom=freedom)


def _mean_of(cuts: Sequence[Mapping[str, Array]]) -> tuple[Trim, Condition]:
    names = [name for name in TRIMMING if name in cuts[0]]
    return trim_of({name: np.concatenate([c[name] for c in cuts]) for name in names})


def _bent(trim: Trim, still: Trim, there: Trim) -> Trim:
    """Return a trim shifted by the difference of two means."""
    return replace(
        trim,
        airspeed_mps=trim.airspeed_mps + there.airspeed_mps - still.airspeed_mps,
        alpha_rad=trim.alpha_rad + there.alpha_rad - still.alpha_rad,
        theta_rad=trim.theta_rad + there.theta_rad - still.theta_rad,
    )


def _changed(
    model: LinearModel, maneuver: Maneuver, still: Mapping[str, Array], other: Mapping[str, Array]
) -> Maneuver:
    """Return a maneuver with the difference of two sets of columns added; itself without any."""

    def moved(names: Sequence[str], values: Array) -> Array:
        own = [n if n in still else "" for n in names]  # a user's column, which no error moves
        if all(other[n] is still[n] or np.array_equal(other[n], still[n]) for n in own if n):
            return values
        none = np.zeros(len(values))
        return values + np.column_stack([other[n] - still[n] if n else none for n in own])

    same = other.get("t_s") is still.get("t_s")
    longer = 1.0 if same else float(np.ptp(other["t_s"]) / np.ptp(still["t_s"]))
    inputs = moved(model.inputs, maneuver.inputs)
    outputs = moved(model.outputs, maneuver.outputs)
    if same and inputs is maneuver.inputs and outputs is maneuver.outputs:
        return maneuver
    return replace(maneuver, dt_s=maneuver.dt_s * longer, inputs=inputs, outputs=outputs)


def is_template(model: LinearModel, trim: Trim) -> bool:
    """Return whether a model equals the template of its name at a trim."""
    if model.name not in TEMPLATES or not (trim.known or model.name in WITHOUT_AIRSPEED):
        return False
    fresh, model = _about(model, trim), without_gust_penetration(model)
    same = fresh.outputs == model.outputs and fresh.terms == model.terms
    return same and bool(np.array_equal(fresh.A, model.A) and np.array_equal(fresh.C, model.C))


def _about(model: LinearModel, trim: Trim) -> LinearModel:
    """Return the template of a model's name at another trim, without lever arms."""
    forces = any(y.startswith("a") and y.endswith("_mps2") for y in model.outputs)
    fresh = template(model.name, trim, accelerometers=forces)
    fresh = with_rate_forces(fresh) if by_prior(model) else fresh
    fresh = without_inputs(fresh, [u for u in fresh.inputs if u not in model.inputs])
    return without_outputs(fresh, [y for y in fresh.outputs if y not in model.outputs])


def retrimmed(model: LinearModel, trim: Trim) -> LinearModel:
    """Return a template's model about another trim."""
    fresh = _about(model, trim)
    own = without_gust_penetration(model)
    bent = replace(own, A=fresh.A, B=fresh.B, C=fresh.C, D=fresh.D, terms=fresh.terms)
    return penetration_of(bent, model)


def in_level_flight(model: LinearModel, trim: Trim) -> LinearModel:
    """Return a template's model about level flight at its angle of attack; others as they are.

    A mean climb, or a pitch angle that is off, damps the phugoid and moves the spiral.
    """
    level = replace(trim, theta_rad=trim.alpha_rad)
    return retrimmed(model, level) if is_template(model, trim) else model


def scaled_by_airspeed(model: LinearModel, trim: Trim) -> set[str]:
    """Return the parameters of a template that are forces over airspeed."""
    faster = replace(trim, airspeed_mps=2.0 * trim.airspeed_mps)
    bent = set(retrimmed(model, faster).terms)
    return {term.parameter for term in model.terms if term.matrix in "CD" and term not in bent}
