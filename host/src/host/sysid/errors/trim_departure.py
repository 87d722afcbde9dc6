"""Correction of a linear fit for airspeed and attitude that varied during the maneuver.

Within 20 s of a multisine airspeed moves by some percent, and with it every derivative, in step
with the surfaces that brake the aircraft. On a simulated flight in calm air, perfect sensors, the
lateral fit has N_p 39 %, N_da twofold and L_dr 53 % off by that. What the departures are is known
(`aerodynamics/varying_airspeed.py`), so the estimate is corrected by one Gauss-Newton step of its
own method: N_p is then 0.5, N_da 11 and L_dr 5 % off.

The drag polar is a parabola in lift; its curvature is estimated along, and drag by the lift of
pitching. So is what follows lift in the lateral motion, the propeller's torque, and what a reduced
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
from host.constants import EVEN_SD
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.aerodynamics.left_out_terms import (
    NEEDED,
    UNKNOWN_MPS,
    terms_left_out,
)
from host.sysid.aerodynamics.path_thrust import rotor_means
from host.sysid.aerodynamics.thrust_terms import thrust_terms
from host.sysid.aerodynamics.unmeasured_motion import with_unmeasured
from host.sysid.aerodynamics.varying_airspeed import LIFT_TERMS, MEASURED, VaryingModel, mean_normal
from host.sysid.errors.departure import Departure, expected_nuisance, with_second_order
from host.sysid.errors.one_step import CERTAIN_SD, HALF_WAY, OneStep, Step, one_step_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.rate_forces import has_rate_forces
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim

REMAINDER_SHARE = 0.25  # of the step: what one step and terms of second order leave open
DEPARTURES = "departures from the linear model"
DRAG_POLAR = "curvature of the drag polar"
THRUST_ACTS = "curvature of the drag polar, and what thrust does"
LATERAL, TORQUE = "lateral", "L_V"
SHARED = ("L_beta", "L_r", "N_p")  # by wing and fin; N_beta is the fin's
LIFT_ACTS = "derivatives that follow lift, and the torque of the propeller"
LEFT_OUT = "motion that the model leaves out"
# Most of D_alpha_alpha over V Z_alpha, which is 2 C_D_CL2 C_L_alpha of a parabolic polar: 0.3 to 1.
LARGEST_CURVATURE = 3.0
NO_SPIN = (0.0, 0.0)
LOOSE_SHARE = 10.0  # of the departures, one deviation


@dataclass(frozen=True, slots=True)
class _Departing:
    """A template whose coefficients depart from those at its trim.

    Attributes
    ----------
    base : LinearModel
        The template.
    trim : Trim
    varying : VaryingModel
        What makes further inputs of the departures.
    data : list of Maneuver
        With these inputs.
    cuts : list of mapping
        All columns of each, those that nobody measured guessed.
    nuisance : dict
        Terms that a template has not: what is expected, and one deviation.
    thrust : dict
        What thrust is expected to do.
    second_order : dict
        What is expected of each term of the drag polar, or that follows lift or airspeed, and one
        deviation.
    """

    base: LinearModel
    trim: Trim
    varying: VaryingModel
    data: list[Maneuver]
    cuts: list[Mapping[str, Array]]
    nuisance: dict[str, tuple[float, float]]
    thrust: dict[str, float]
    second_order: dict[str, tuple[float, float]]

    @property
    def along(self) -> dict[str, float]:
        """What is estimated along, and one deviation of each."""
        return {name: sd for name, (_, sd) in (self.second_order | self.nuisance).items()}

    @property
    def expected(self) -> dict[str, float]:
        """What terms of second order and thrust are expected to do."""
        return {name: mean for name, (mean, _) in self.second_order.items()} | self.thrust

    @property
    def cause(self) -> str:
        """What an answer calls that of which the data leave something open."""
        if self.varying.left_out:
            return LEFT_OUT
        if self.varying.axis == LATERAL:
            return LIFT_ACTS
        return THRUST_ACTS if self.varying.thrust else DRAG_POLAR

    def model(self, known: Mapping[str, float]) -> LinearModel:
        """Return the model with departures, some of what is estimated along at known values."""
        return with_second_order(self.varying.model, self.base, {**self.expected, **known})

    def step(self, one_step: OneStep) -> Step:
        """Return the step of the estimate, and of what is estimated along."""
        unit = {name: self.expected.get(name, 0.0) + 1.0 for name in self.along}
        bends = [(self.model({name: value}), self.data) for name, value in unit.items()]
        deviations = list(self.along.values())
        return one_step.joint(self.model({}), self.trim, self.data, bends, deviations)

    def found(self, step: Step, open_ones: Sequence[ShiftedEstimate]) -> Departure:
        """Return the departure of a step, and what stays open of it."""
        known = {
            name: self.expected.get(name, 0.0) + float(value)
            for name, value in zip(self.along, step.added, strict=True)
        }
        # What is fitted with thrust has the drag polar too.
        polar = self.second_order if self.thrust else {}
        return Departure(
            step.shares, tuple(open_ones), self.varying, self.model(known),
            tuple(self.data), polar | self.nuisance,
        )  # fmt: skip


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
        Angular momentum of the rotor (`spin_of`), which joins pitch and yaw.
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
    departing = _departing(result, maneuvers, cuts, airframe, trim, spin)
    one_step = one_step_of(result, maneuvers if fitted is None else fitted, departing.trim)
    if one_step is None:
        return None
    guessed = any(c not in cut for cut in cuts for c in _needed(base))
    if guessed and _guessed_in_vain(one_step, result, maneuvers, departing):
        return None
    found = departing.step(one_step)
    if not np.isfinite(found.shares).all():
        return None
    moved = result.estimate + found.shares.sum(axis=0)
    open_ones = [
        (DEPARTURES, REMAINDER_SHARE * found.shares.sum(axis=0)),
        *((departing.cause, shift) for shift in _root(found.covariance) @ found.by_added),
    ]
    return departing.found(
        found, [ShiftedEstimate(name, moved + s, 1.0, 1.0) for name, s in open_ones]
    )


def _departing(
    result: FitResult,
    maneuvers: Sequence[Maneuver],
    cuts: Sequence[Mapping[str, Array]],
    airframe: AirframeData | None,
    trim: Trim,
    spin: tuple[float, float],
) -> _Departing:
    """Return the model of a result with its departures, and what they are in the columns."""
    base = result.model
    left_out = terms_left_out(base.name, cuts[0], trim)
    if not trim.known:
        trim = replace(trim, airspeed_mps=UNKNOWN_MPS)
    whole = [with_unmeasured(c, base, result.estimate, trim) for c in cuts]
    thrust = thrust_terms(base, whole, trim, airframe)
    normal = mean_normal(whole, trim)
    varying = VaryingModel(base, base.name, trim, airframe, spin, left_out, thrust, normal)
    nuisance = expected_nuisance(result, (*left_out, *thrust))
    return _Departing(
        base,
        trim,
        varying,
        [
            replace(m, inputs=varying.maneuver(c, m.dt_s).inputs)
            for m, c in zip(maneuvers, whole, strict=True)
        ],
        list(whole),
        nuisance,
        {t.name: nuisance[t.name][0] for t in thrust},
        _polar(result, trim, pitching=not thrust) | _following(result),
    )


def _guessed_in_vain(
    one_step: OneStep, result: FitResult, maneuvers: Sequence[Maneuver], departing: _Departing
) -> bool:
    """Return whether departures of columns that nobody measured are no part of the record.

    Without accelerometers the lift of pitching passes for a scale of alpha: nothing is guessed
    where the model has none.
    """
    varying = departing.varying
    if varying.left_out:
        return False
    forceless = not varying.forces and not has_rate_forces(departing.base)
    return forceless or _linear(one_step, result, maneuvers, departing)


def _linear(
    one_step: OneStep,
    result: FitResult,
    maneuvers: Sequence[Maneuver],
    departing: _Departing,
) -> bool:
    """Return whether the record has no departures, as a linear simulator's.

    Departures of columns that nobody measured are a guess. How much of them is there is one more
    parameter: what they add is not there in a linear lateral record in white noise, and the test of
    coherence widens L_p 2.6 times by it.
    """
    whole = (departing.model({}), departing.data)
    share, sd = one_step.share_of(whole, result, departing.trim, maneuvers, LOOSE_SHARE)
    return share < HALF_WAY and 1.0 - share > CERTAIN_SD * sd


def _needed(model: LinearModel) -> tuple[str, ...]:
    """Return the columns without which departures of a model rest on a guess.

    A side force matters only as an output. What else accelerometers say turns sideslip by the load
    factor alone: without ay N_da of a light aircraft is 24 % off, known to 6, if nothing is taken
    out.
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
    return name in LIFT_TERMS and all(c in cut for cut in cuts for c in needed)


def _root(covariance: Array) -> Array:
    """Return rows whose outer products sum to a covariance."""
    value, vector = np.linalg.eigh(covariance)
    return np.asarray((vector * np.sqrt(np.maximum(value, 0.0))).T)


def _polar(result: FitResult, trim: Trim, *, pitching: bool) -> dict[str, tuple[float, float]]:
    """Return what is expected of each term of the drag polar, and one deviation.

    Left out, they move M_q by 1.8 % in calm air, and the test of coherence names ax. Lift of
    pitching drags by anything from nothing, where a tail makes it, to all that the polar has for
    it, evenly: left out, CD_de is low by two to four half-widths where drag follows all lift. With
    measured thrust, where the polar is fitted at once with it, it is not tried.
    """
    if "ax_mps2" not in result.model.outputs or "D_alpha" not in result.names:
        return {}
    drag, lift, by_rate = (result.value(name) for name in ("D_alpha", "Z_alpha", "Z_q"))
    curvature = (0.0, LARGEST_CURVATURE * trim.airspeed_mps * abs(lift))
    whole = drag * by_rate / lift
    by_pitching = {"D_q": (0.5 * whole, 0.5 * EVEN_SD * abs(whole))} if pitching else {}
    return {"D_alpha_alpha": curvature, **by_pitching}


def _following(result: FitResult) -> dict[str, tuple[float, float]]:
    """Return what is expected of terms that follow lift or airspeed, and one deviation.

    Wing and fin share a derivative that follows lift: anything from nothing to all of it does,
    evenly. How much more the aileron that holds against the propeller's torque holds at a higher
    airspeed is free: no aircraft file says it. Moments about the other axes are not: taken along,
    Cn_r of logs without vanes has 2.6 times its error.
    """
    if result.model.name != LATERAL:
        return {}
    found = {TORQUE: (0.0, np.inf)}
    for name in (n for n in SHARED if n in result.names):
        value, error = result.value(name), float(result.standard_error[result.index(name)])
        found[f"{name}_lift"] = (0.5 * value, 0.5 * EVEN_SD * float(np.hypot(value, error)))
    return found


def spin_of(
    powerplant: Powerplant | None, cuts: Sequence[Mapping[str, Array]]
) -> tuple[float, float]:
    """Return the mean angular momentum of the rotor along x and z, kg m2/s."""
    means = rotor_means(powerplant, cuts)
    if powerplant is None or means is None:
        return NO_SPIN
    momentum = powerplant.rotor_kgm2 * means[1] * powerplant.axis
    return float(momentum[0]), float(momentum[2])
