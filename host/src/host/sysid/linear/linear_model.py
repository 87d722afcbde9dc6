"""Which linear model is fitted: a template at the trim of the flight, by what a method can free."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import Condition
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel, deviations, unknown_sensors
from host.physical.recording import OWN
from host.sysid.aerodynamics.coefficient_table import trim_of
from host.sysid.estimators.gust_model import VANES
from host.sysid.estimators.method_registry import find_method
from host.sysid.estimators.start_values import regression_estimates
from host.sysid.flight.filter_step import (
    feels_roll,
    no_filter_step,
    rolling_gust_identifiable,
)
from host.sysid.flight.fitted_maneuvers import columns_of, fitted_and_held_out
from host.sysid.flight.flown_maneuver import FlownManeuver
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.linear.model_names import AXIS_OF, DEFAULT_METHOD, GUST, STAGED
from host.sysid.linear.unmeasured_angles import without_vanes
from host.sysid.maneuvers.maneuver_selection import excited_axes
from host.sysid.models.rate_forces import with_rate_forces
from host.sysid.models.reduced_model import without_inputs, without_outputs
from host.sysid.models.residual_delays import (
    OTHERS_DELAYS,
    STANDARD_DELAYS,
    without_standard_delays,
)
from host.sysid.models.state_space_model import DelayGroup, LinearModel
from host.sysid.models.templates import TEMPLATES, Trim, template
from host.sysid.numerics.model_problems import needs_compiler
from host.sysid.reconstruction.path_preparation import NO_OFFSETS

NO_AIRSPEED = (
    "the data have no airspeed_mps: it is taken as constant; accelerations, gusts and coefficients"
    " need it and are left out"
)
# Forces along it need it, all else is determined without.
DOUBTFUL = {"ay_mps2"}
SIDE_FORCE_DOUBTED = "ay_mps2 has an open finding, and is left out of the fit"
STILL_RAD = 1e-9  # a surface that moves less stands still but for rounding


@dataclass(frozen=True)
class ChosenModel:
    """Choice of model, maneuvers and method.

    Attributes
    ----------
    template : str
        What the model is called in messages.
    model : LinearModel
    method : str
        The one that the default comes to.
    asked : str
        As asked for.
    own : bool
        The model is one of the user's own.
    trim, condition
        Means over the maneuvers of the fit.
    used, held_out : tuple of FlownManeuver
        In the fit, and kept for validation.
    remarks : tuple of str
        What is said of the choice.
    """

    template: str
    model: LinearModel
    method: str
    asked: str
    own: bool
    trim: Trim
    condition: Condition
    used: tuple[FlownManeuver, ...]
    held_out: tuple[FlownManeuver, ...]
    remarks: tuple[str, ...]

    @property
    def gust_is_state(self) -> bool:
        """Whether the gust is a state of the fit of a template."""
        vanes = set(self.model.states) & set(VANES)
        return self.method == GUST and not self.own and self.trim.known and bool(vanes)


def choose_model(
    flights: Sequence[ReconstructedFlight],
    template_name: str,
    method: str,
    own: LinearModel | None,
    *,
    named: bool,
) -> ChosenModel:
    """Return the model to fit, the method that the default one comes to, and the maneuvers.

    Parameters
    ----------
    flights : sequence of ReconstructedFlight
    template_name : str
    method : str
        As asked for.
    own : LinearModel or None
        The user's own, in place of the template.
    named : bool
        The user asked for this model: a stretch given is a maneuver of it, whatever moved more.

    Raises
    ------
    IdentificationError
        If there is no maneuver of the model, or the method needs an airspeed that is not known.
    """
    axes = AXIS_OF[template_name] if own is None else excited_axes(own.inputs)
    free = own is not None and not own.controls()
    used, held = fitted_and_held_out(
        flights, axes, template_name, named=named or own is not None, free=free
    )
    trim, condition = trim_of(columns_of(used))
    if own is None:
        model, by, remarks = template_and_method(used, trim, template_name, method)
    else:
        by = method
        model, remarks = with_starts_of(own, (*used, *held))
        if not _delays_free(used, method):
            model = without_standard_delays(model)
    called = template_name if own is None else model.name
    return ChosenModel(
        called, model, by, method, own is not None, trim, condition, tuple(used), tuple(held),
        remarks,
    )  # fmt: skip


def with_starts_of(
    own: LinearModel, flown: Sequence[FlownManeuver]
) -> tuple[LinearModel, tuple[str, ...]]:
    """Return a user's model for some maneuvers, and a remark where it is another.

    Known initial states belong to the start of a record, or of a stretch that the user gave.
    """
    if not own.known_starts or all(m.found.given or m.begins_its_record for m in flown):
        return own, ()
    known = [state for state, _ in own.known_starts]
    free = tuple(s for s in own.states if s in (*own.initial_states, *known))
    remark = f"{', '.join(known)}: known where the record begins, free in maneuvers found inside it"
    return replace(own, initial_states=free, known_starts=()), (remark,)


def template_and_method(
    used: Sequence[FlownManeuver], trim: Trim, name: str, method: str
) -> tuple[LinearModel, str, tuple[str, ...]]:
    """Return a template at the trim, the method that the default one comes to, and remarks.

    Parameters
    ----------
    used : sequence of FlownManeuver
        Those of the fit.
    trim : Trim
    name : str
        The template.
    method : str
        As asked for.

    Raises
    ------
    IdentificationError
        If the method needs an airspeed that is not known.
    """
    if method == GUST and not trim.known:
        raise IdentificationError(
            f"{GUST} needs airspeed_mps, which tells how fast gusts pass; give another method"
        )
    model, remarks = _without_doubtful(used, trim, name, method)
    known = used[0].flight.compatibility
    if known is not None and known.instrument is not None and frees_places(method):
        model = with_drag_arm(model, trim, known.instrument)
    if method == GUST:
        why = no_filter_step(used, model)
        remarks = (*remarks, f"{why}: L_p and L_da may come out small") if why else remarks
    if method != DEFAULT_METHOD:
        return model, method, remarks
    by, why = _default_method(model, used, trim)
    if by != GUST and name == "lateral":
        model = without_attitude(model, used)
    return model, by, (*remarks, why) if why else remarks


def _without_doubtful(
    used: Sequence[FlownManeuver], trim: Trim, name: str, method: str
) -> tuple[LinearModel, tuple[str, ...]]:
    """Return a template of the columns that all maneuvers have and no finding doubts."""
    shared = set.intersection(*(set(m.flight.corrected) for m in used))
    doubted = shared & DOUBTFUL if _in_doubt(used) else set()
    able = _delays_free(used, method)
    model, remarks = fitted_template(shared - doubted, name, used, trim, method, able=able)
    if doubted and "beta_rad" in model.states:
        remarks = (*remarks, SIDE_FORCE_DOUBTED)
    return model, remarks


def _delays_free(used: Sequence[FlownManeuver], method: str) -> bool:
    """Return whether delays and places of the sensors are for the fit to estimate."""
    return frees_places(method) and all(m.flight.delays_open for m in used)


def _in_doubt(used: Sequence[FlownManeuver]) -> bool:
    """Return whether a side force alone is in doubt, and the user does not say that it is right."""
    findings = (f for m in used for f in m.flight.findings)
    return any(set(f.channels) == DOUBTFUL and not f.accepted for f in findings)


def _default_method(
    model: LinearModel, used: Sequence[FlownManeuver], trim: Trim
) -> tuple[str, str]:
    """Return what fits a template, and why it is not the gust filter where that was to be."""
    # Our own log is filtered laterally only where its sensors are known (`filter_step`).
    rolls = feels_roll(model) and rolling_gust_identifiable(used)
    vane = "beta_rad" if rolls else "alpha_rad"
    if not (trim.known and vane in model.states and vane in model.outputs):
        return "output-error-white", ""
    data = [m.cut(model) for m in used]
    why = needs_compiler(model, data) or no_filter_step(used, model)
    return ("output-error-white", f"{why}; output error stands instead") if why else (GUST, "")


def standard_delays(used: Sequence[FlownManeuver]) -> tuple[DelayGroup, ...]:
    """Return the delays that sensors may have: of our logger's, or of others'."""
    ours = all(m.flight.maker == OWN for m in used)
    return STANDARD_DELAYS if ours else OTHERS_DELAYS


def template_at(
    columns: Collection[str],
    name: str,
    trim: Trim,
    method: str,
    delays: Sequence[DelayGroup],
    *,
    able: bool,
) -> LinearModel:
    """Return a template about a trim; `able` frees delays and the places of accelerometers."""
    if name not in TEMPLATES:
        raise IdentificationError(f"no template '{name}'; there are {', '.join(TEMPLATES)}")
    across = "az_mps2" if "elevator_rad" in AXIS_OF[name] else "ay_mps2"
    found = template(
        name,
        trim,
        accelerometers=_ties(method) and trim.known and across in columns,
        delays=tuple(delays) if able else (),
        imu_sd_m=imu_place_m(unknown_sensors()) if able else 0.0,
    )
    if across not in found.outputs and frees_places(method):
        found = with_rate_forces(found)
    return found if "ax_mps2" in columns else without_outputs(found, ("ax_mps2",))


def fitted_template(
    columns: Collection[str],
    name: str,
    used: Sequence[FlownManeuver],
    trim: Trim,
    method: str,
    *,
    able: bool,
) -> tuple[LinearModel, tuple[str, ...]]:
    """Return a template about a trim with the inputs that moved, and remarks on what it lacks.

    A flying wing has no rudder, and a surface that stood still says nothing.
    """
    delays = standard_delays(used)
    whole = template_at(columns, name, trim, method, delays, able=able)
    model, remarks = without_vanes(whole, columns)
    remarks += () if trim.known else (NO_AIRSPEED,)
    absent = [u for u in model.inputs if u not in columns]
    still = [
        u
        for u in model.inputs
        if u not in absent and all(float(np.ptp(m.inside()[u])) < STILL_RAD for m in used)
    ]
    out = absent + still
    if not out or len(out) == len(model.inputs):
        return model, remarks  # what is missing altogether is refused where the data are cut
    why = [f"{u} is not in the data" for u in absent] + [f"{u} never moved" for u in still]
    left = without_inputs(model, out)
    kept = {p.name for p in left.parameters}
    lost = [p.name for p in model.parameters if p.name not in kept]
    return left, (*remarks, f"{', '.join(why)}: {', '.join(lost)} left out")


def frees_places(method: str) -> bool:
    """Return whether a method can estimate delays and places of accelerometers."""
    by = None if method in STAGED else find_method(method)
    return by.estimates_delays if by else method in STAGED


def _ties(method: str) -> bool:
    """Return whether a method takes accelerations, which repeat the entries of other equations."""
    by = None if method in STAGED else find_method(method)
    return by is None or by.ties


def imu_place_m(i: SensorErrorModel) -> float:
    """Return one deviation of the IMU's height above the CG, m: tape measure and balance."""
    sd = deviations(i, NO_OFFSETS)
    return float(np.hypot(sd["imu_z_m"], sd["cg_z_m"]))


def with_drag_arm(model: LinearModel, trim: Trim, i: SensorErrorModel) -> LinearModel:
    """Free the height of the accelerometers where drag is fitted: a pitch rate makes none.

    Every other place is carried. This one moves drag by more than its size, and the pitch rate,
    with angle and elevator, determines it.
    """
    if "ax_mps2" not in model.outputs:
        return model
    sd_m = imu_place_m(i)
    free = template(model.name, trim, accelerometers=True, imu_sd_m=sd_m)
    kept = [x for x in free.accelerometer_offsets if x.output == "ax_mps2"]
    names = {x.parameter for x in free.accelerometer_offsets} - {x.parameter for x in kept}
    return replace(
        model,
        accelerometer_offsets=tuple(kept),
        parameters=tuple(p for p in free.parameters if p.name not in names),
    )


def without_attitude(model: LinearModel, used: Sequence[FlownManeuver]) -> LinearModel:
    """Leave the bank angle of the attitude filter out of the fit, started from one with it.

    It is made of the same gyro and of accelerometers that take side force for gravity: on the
    recorded demonstration flight 15 of 15 intervals hold the truth without it, 12 with it.
    """
    regression = regression_estimates(model, [m.cut(model) for m in used])
    model = model.with_start([regression.get(p.name, p.start) for p in model.parameters])
    reduced = without_outputs(model, ("phi_rad",))
    return replace(reduced, state_biases=tuple(s for s in reduced.state_biases if s != "phi_rad"))
