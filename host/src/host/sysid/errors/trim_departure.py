"""Correction of a linear fit for airspeed and attitude that varied during the maneuver.

Within 20 s of a multisine airspeed moves by some percent, and with it every derivative, in step
with the surfaces that brake the aircraft. On a simulated flight in calm air, perfect sensors, the
lateral fit has N_p 39 %, N_da twofold and L_dr 53 % off by that. What the departures are is known
(`aerodynamics/varying_airspeed.py`), so the estimate is corrected by one Gauss-Newton step of its
own method: N_p is then 0.5, N_da 11 and L_dr 5 % off.

A gust that is written in body axes turns with the aircraft: one along the path of 2 % of the
airspeed makes the angle of attack follow the pitch rate by 2 % more. What is left of the angle is
then held to be a gust, and where the tail feels gusts M_alpha is 2.7 % off by that. Whether air
turns so, and by how much, no maneuver tells: intervals count it.

The airspeed is measured, and its noise is in every departure: drawn anew it moves the estimate by
as much as it has moved it already, and that counts in the covariance.

The drag polar is a parabola in lift; its curvature is estimated along. So is what a reduced
template leaves out of the other lateral states (`aerodynamics/left_out_terms.py`). Filter error
with the gust is fitted to what output error says is left without departures, and corrected by what
that left.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.aerodynamics.left_out_terms import (
    NEEDED,
    UNKNOWN_MPS,
    LeftOutTerm,
    expected_left_out,
    terms_left_out,
)
from host.sysid.aerodynamics.path_thrust import rotor_means
from host.sysid.aerodynamics.thrust_terms import thrust_terms
from host.sysid.aerodynamics.unmeasured_motion import with_unmeasured
from host.sysid.aerodynamics.varying_airspeed import MEASURED, SECOND_ORDER_TERMS, VaryingModel
from host.sysid.errors.one_step import CERTAIN_SD, HALF_WAY, OneStep, one_step_of
from host.sysid.estimators.gust_model import gust_deviation_mps
from host.sysid.models.consider_covariance import consider_covariance
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.rate_forces import has_rate_forces
from host.sysid.models.state_space_model import LinearModel, Parameter
from host.sysid.models.templates import Trim
from host.sysid.models.thrust_column import ThrustColumn
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.white_noise import white_deviation

TURNED_ANGLES = ("alpha_rad", "beta_rad")
REMAINDER_SHARE = 0.25  # of the step: what one step and terms of second order leave open
DEPARTURES = "departures from the linear model"
DRAG_POLAR = "curvature of the drag polar"
THRUST_ACTS = "curvature of the drag polar, and what thrust does"
LEFT_OUT = "motion that the model leaves out"
TURNING_AIR = "gust along the path, turning with the aircraft"
# Deviation of that gust, in the deviation of the gusts found. Near the ground it is 1.3 of theirs
# (MIL-F-8785C, 3.7.2), the mean over a maneuver less. With 0.5 M_alpha held in 55 of 64 flights of
# an independent simulator; 1.3 would make intervals in air that stays with the ground five times
# the rms error.
TURNING_SHARE = 0.8
# Of D_alpha_alpha over V Z_alpha, which is 2 C_D_CL2 C_L_alpha of a parabolic polar: 0.3 to 1.
LARGEST_CURVATURE = 3.0
NO_SPIN = (0.0, 0.0)
LOOSE_SHARE = 10.0  # of the departures, one deviation
DRAWS = 4  # of the noise of the airspeed, each anew in every maneuver


@dataclass(frozen=True, slots=True)
class Departure:
    """By how much an estimate moves, and what one step and second order leave open of it.

    Attributes
    ----------
    shares : Array, shape (maneuvers, P)
        By how much each maneuver moves the joint estimate.
    remainders : tuple of ShiftedEstimate
    airspeed_noise : Array, shape (P, P)
        What the noise of the measured airspeed adds to the covariance.
    varying : VaryingModel
        What makes further inputs of the departures.
    model : LinearModel
        With these inputs.
    maneuvers : tuple of Maneuver
        Those fitted, with these inputs.
    beside : dict
        Terms that a template has not, of motion or thrust that was measured: what is expected, and
        one deviation.
    """

    shares: Array
    remainders: tuple[ShiftedEstimate, ...]
    airspeed_noise: Array
    varying: VaryingModel
    model: LinearModel
    maneuvers: tuple[Maneuver, ...]
    beside: dict[str, tuple[float, float]]

    @property
    def step(self) -> Array:
        """By how much the estimate moves, (P,)."""
        return np.asarray(self.shares.sum(axis=0))

    def influence(self, details: Mapping[str, float | Array]) -> dict[str, Array]:
        """Return the influence of each maneuver on the estimate moved, of that in the details.

        Maneuvers whose airspeed went different ways disagree before the step, not behind it.
        """
        influence = details.get("maneuver_influence")
        if not isinstance(influence, np.ndarray):
            return {}
        tested = np.any(influence != 0.0, axis=0)  # what need not agree stays out of the test
        return {"maneuver_influence": influence + tested * self.shares}

    @property
    def thrust(self) -> ThrustColumn | None:
        """What measured thrust does; None where it stayed as airspeed has it, or is not known."""
        own = {t.input_name for t in self.varying.thrust}
        columns = [k for k, name in enumerate(self.model.inputs) if name in own]
        if not columns:
            return None
        return ThrustColumn(*(M[:, columns].sum(axis=1) for M in (self.model.B, self.model.D)))

    def wide_model(self, base: LinearModel) -> LinearModel:
        """Return a template with the departures as inputs, and the terms estimated along as
        parameters behind its own."""
        known = _with_second_order(self.varying.model, base, {})
        more = [t for t in self.varying.model.terms if t.parameter in self.beside]
        added = (Parameter(name, mean, prior_sd=sd) for name, (mean, sd) in self.beside.items())
        return replace(
            known,
            terms=(*known.terms, *more),
            parameters=(*known.parameters, *added),
            delays=base.delays,
        )

    def expecting(self, result: FitResult) -> Departure:
        """Return the same with what another fit of the template says of the size of the terms."""
        return replace(self, beside=_left_out(result, self.varying.left_out))

    def of_fit(self, wide: FitResult, length: int) -> Departure:
        """Return the departures as a fit of `wide_model` has them: nothing is left to be moved.

        `length` is that of the estimate without the terms.
        """
        known = {name: wide.value(name) for name in self.beside}
        return replace(
            self,
            shares=np.zeros((len(self.maneuvers), length)),
            remainders=(),
            airspeed_noise=np.zeros((length, length)),
            model=_with_second_order(self.varying.model, self.varying.base, known),
        )

    def removed_from(self, maneuvers: Sequence[Maneuver], estimate: Array) -> list[Maneuver]:
        """Return the maneuvers as if nothing had departed; as they are if the model diverges.

        Parameters
        ----------
        maneuvers : sequence of Maneuver
            As fitted.
        estimate : Array
            Common parameters first.
        """
        return self._removed(self.maneuvers, maneuvers, estimate)

    def removed_from_held_out(
        self,
        maneuvers: Sequence[Maneuver],
        cuts: Sequence[Mapping[str, Array]],
        estimate: Array,
    ) -> list[Maneuver]:
        """Return maneuvers that were not fitted, departures from the trim removed.

        `cuts` holds all columns of each.
        """
        varying = self.varying
        whole = [with_unmeasured(c, varying.base, estimate, varying.trim) for c in cuts]
        wide = [
            replace(m, inputs=varying.maneuver(c, m.dt_s).inputs)
            for m, c in zip(maneuvers, whole, strict=True)
        ]
        return self._removed(wide, maneuvers, estimate)

    def _removed(
        self, departing: Sequence[Maneuver], maneuvers: Sequence[Maneuver], estimate: Array
    ) -> list[Maneuver]:
        return without_further_inputs(self.model, departing, maneuvers, estimate)


def without_further_inputs(
    model: LinearModel,
    departing: Sequence[Maneuver],
    maneuvers: Sequence[Maneuver],
    estimate: Array,
) -> list[Maneuver]:
    """Return maneuvers as if the further inputs of a model had been none; as they are if it
    diverges.

    Parameters
    ----------
    model : LinearModel
    departing : sequence of Maneuver
        With all inputs of the model.
    maneuvers : sequence of Maneuver
        The same, with the first of them.
    estimate : Array
        Common parameters first.
    """
    if not maneuvers:
        return []
    trimmed = [
        replace(
            wide,
            inputs=np.hstack([own.inputs, np.zeros_like(wide.inputs[:, own.inputs.shape[1] :])]),
        )
        for wide, own in zip(departing, maneuvers, strict=True)
    ]
    problems = [OutputProblem(model, data) for data in (departing, trimmed)]
    theta = problems[0].first_guess()
    theta[: problems[0].n_common] = estimate[: problems[0].n_common]
    there, here = (problem.outputs(theta) for problem in problems)
    if there is None or here is None:
        return list(maneuvers)
    return [
        replace(m, outputs=m.outputs - (moved - still).T)
        for m, moved, still in zip(maneuvers, there, here, strict=True)
    ]


def correct_trim_departure(
    result: FitResult,
    maneuvers: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    airframe: AirframeData | None,
    trim: Trim,
    spin: tuple[float, float] = NO_SPIN,
    fitted: Sequence[Maneuver] | None = None,
) -> Departure | None:
    """Return the shift of the estimate of a template by the departures from its trim.

    Parameters
    ----------
    result : FitResult
    maneuvers : sequence of Maneuver
        As measured.
    cuts : sequence of mapping
        All columns of each maneuver.
    airframe : AirframeData or None
        Inertia; without, what body rates do to each other is left out.
    trim : Trim
    spin : tuple
        Of the rotor (`spin_of`), which joins pitch and yaw.
    fitted : sequence of Maneuver, optional
        What the result was fitted to, if departures had been removed from it; the shift is then
        what the removal left.

    Returns
    -------
    Departure or None
        None where departures of the model are not known, not measured, or guessed and not there.
    """
    base = result.model
    if not departures_measured(base.name, cuts):
        return None
    left_out = terms_left_out(base.name, cuts[0], trim)
    if not trim.known:
        trim = replace(trim, airspeed_mps=UNKNOWN_MPS)
    assumed = any(c not in cut for cut in cuts for c in _needed(base))
    cuts = [with_unmeasured(c, base, result.estimate, trim) for c in cuts]
    one_step = one_step_of(result, maneuvers if fitted is None else fitted, trim)
    if one_step is None:
        return None
    thrust = thrust_terms(base, cuts, trim, airframe)
    varying = VaryingModel(base, base.name, trim, airframe, spin, left_out, thrust)
    # Without accelerometers the lift of pitching passes for a scale of alpha: nothing is guessed
    # where the model has none.
    guessed = assumed and not left_out
    if guessed and not varying.forces and not has_rate_forces(base):
        return None
    beside = _left_out(result, (*left_out, *thrust))
    expected = {t.name: beside[t.name][0] for t in thrust}
    straight = _with_second_order(varying.model, base, expected)
    polar = _curvature_sd(result, trim)
    along = polar | {name: sd for name, (_, sd) in beside.items()}
    curved = [
        _with_second_order(varying.model, base, {**expected, name: expected.get(name, 0.0) + 1.0})
        for name in along
    ]
    if thrust:  # what is fitted with it has the drag polar beside it
        beside = {name: (0.0, sd) for name, sd in polar.items()} | beside
    data = [
        replace(m, inputs=varying.maneuver(c, m.dt_s).inputs)
        for m, c in zip(maneuvers, cuts, strict=True)
    ]
    if guessed and _linear(one_step, result, maneuvers, straight, data, trim):
        return None
    bends = [(model, data) for model in curved]
    found = one_step.joint(straight, trim, data, bends, list(along.values()))
    if not np.isfinite(found.shares).all():
        return None
    step = found.shares.sum(axis=0)
    unknown = _root(found.covariance) @ found.by_added
    cause = LEFT_OUT if left_out else THRUST_ACTS if thrust else DRAG_POLAR
    # Only the fit that stands has intervals: the rough one before it is measured as it is.
    along_mps = 0.0 if fitted is None else gust_deviation_mps(result, trim.airspeed_mps)
    turned: Array = np.zeros((0, len(step)))
    noise: Array = np.zeros((len(step), len(step)))
    if fitted is not None:
        still = one_step.change(straight, trim, data)
        if along_mps > 0.0:
            moved = one_step.change(_with_turning_gust(straight), trim, data)
            turned = TURNING_SHARE * along_mps * (moved - still)
        deviation = float(white_deviation([c["airspeed_mps"] for c in cuts]))
        noisy = [_with_airspeed_noise(varying, data, cuts, deviation, n) for n in range(DRAWS)]
        drawn = [one_step.change(straight, trim, one) - still for one in noisy]
        fitted_too = np.diag(result.covariance) > 0.0  # what the fit left out stays out
        noise = consider_covariance(np.vstack(drawn) * fitted_too / np.sqrt(DRAWS))
    known = {
        name: expected.get(name, 0.0) + float(value)
        for name, value in zip(along, found.added, strict=True)
    }
    return Departure(
        found.shares,
        (
            ShiftedEstimate(DEPARTURES, result.estimate + step + REMAINDER_SHARE * step, 1.0, 1.0),
            *(ShiftedEstimate(cause, result.estimate + step + s, 1.0, 1.0) for s in unknown),
            *(ShiftedEstimate(TURNING_AIR, result.estimate + step + s, 1.0, 1.0) for s in turned),
        ),
        noise,
        varying,
        _with_second_order(varying.model, base, known),
        tuple(data),
        beside,
    )


def _linear(
    one_step: OneStep,
    result: FitResult,
    maneuvers: Sequence[Maneuver],
    departing: LinearModel,
    data: Sequence[Maneuver],
    trim: Trim,
) -> bool:
    """Return whether the record has no departures, as a linear simulator's.

    Of columns that nobody measured they are a guess. How much of them is there is one more
    parameter: of a linear lateral record in white noise what they added was not there, and the
    test of coherence widened L_p 2.6 times.
    """
    whole = (departing, data)
    share, sd = one_step.share_of(whole, result, trim, maneuvers, LOOSE_SHARE)
    return share < HALF_WAY and 1.0 - share > CERTAIN_SD * sd


def _needed(model: LinearModel) -> tuple[str, ...]:
    """Return the columns without which departures of a model rest on a guess.

    A side force matters only as an output. What else accelerometers say turns sideslip by the load
    factor alone: of a light aircraft without ay N_da was 24 % off, known to 6, when nothing was
    taken out.
    """
    still_known = MEASURED[-3:] if "beta_rad" in model.states else ("ay_mps2",)
    return tuple(c for c in MEASURED if c not in still_known)


def departures_measured(name: str, cuts: Sequence[Mapping[str, Array]]) -> bool:
    """Return whether departures of a template are known, and measured in all maneuvers.

    Parameters
    ----------
    name : str
        The template.
    cuts : sequence of mapping
        All columns of each maneuver.
    """
    needed = NEEDED.get(name, ("airspeed_mps",))
    return name in SECOND_ORDER_TERMS and all(c in cut for cut in cuts for c in needed)


def _root(covariance: Array) -> Array:
    """Return rows whose outer products sum to a covariance."""
    value, vector = np.linalg.eigh(covariance)
    return np.asarray((vector * np.sqrt(np.maximum(value, 0.0))).T)


def _left_out(result: FitResult, terms: Sequence[LeftOutTerm]) -> dict[str, tuple[float, float]]:
    """Return what is expected of each term that the template leaves out, by its neighbours."""
    error = result.standard_error
    like = {t.like for t in terms if t.like}
    known = {n: (result.value(n), float(error[result.index(n)])) for n in like}
    return expected_left_out(terms, known)


def _curvature_sd(result: FitResult, trim: Trim) -> dict[str, float]:
    """Return which term of second order the data tell, and its prior deviation.

    Left out, M_q was 1.8 % off in calm air, and the test of coherence named ax.
    """
    if "ax_mps2" not in result.model.outputs or "Z_alpha" not in result.names:
        return {}
    lift = trim.airspeed_mps * abs(result.value("Z_alpha"))
    return {
        name: LARGEST_CURVATURE * lift
        for name, row, _ in SECOND_ORDER_TERMS[result.model.name]
        if row == "airspeed_mps"
    }


def _with_second_order(
    varying: LinearModel, base: LinearModel, known: Mapping[str, float]
) -> LinearModel:
    """Return the model with departures, terms of second order at known values, others at none."""
    more = {p.name for p in varying.parameters[len(base.parameters) :]}
    B, D = varying.B.copy(), varying.D.copy()
    for t in varying.terms:
        if t.parameter in known and t.matrix in "BD":
            (B if t.matrix == "B" else D)[t.row, t.column] += t.gain * known[t.parameter]
    return replace(
        varying,
        name=base.name,
        B=B,
        D=D,
        terms=tuple(t for t in varying.terms if t.parameter not in more),
        parameters=base.parameters,
    )


def _with_airspeed_noise(
    varying: VaryingModel,
    data: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    deviation_mps: float,
    draw: int,
) -> list[Maneuver]:
    """Return the maneuvers with white noise added to the airspeed once more."""
    rng, noisy = np.random.default_rng(draw), []
    for maneuver, columns in zip(data, cuts, strict=True):
        speed = columns["airspeed_mps"]
        noise = deviation_mps * rng.standard_normal(len(speed))
        inputs = varying.maneuver({**columns, "airspeed_mps": speed + noise}, maneuver.dt_s).inputs
        noisy.append(replace(maneuver, inputs=inputs))
    return noisy


def _with_turning_gust(varying: LinearModel) -> LinearModel:
    """Return the model with a steady gust of 1 m/s along the path that turns with the aircraft."""
    B = varying.B.copy()
    for column, name in enumerate(varying.inputs):
        row = name.removeprefix("turning x on ")
        if row in TURNED_ANGLES:
            B[varying.states.index(row), column] = 1.0
    return replace(varying, B=B)


def spin_of(
    powerplant: Powerplant | None, cuts: Sequence[Mapping[str, Array]]
) -> tuple[float, float]:
    """Return the mean angular momentum of the rotor along x and z, kg m2/s."""
    means = rotor_means(powerplant, cuts)
    if powerplant is None or means is None:
        return NO_SPIN
    momentum = powerplant.rotor_kgm2 * means[1] * powerplant.axis
    return float(momentum[0]), float(momentum[2])
