"""Linear models of a flight: estimation, intervals, validation, each a stage that adds its part.

A stage hands on what it made; none changes what an earlier one said.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.sysid.aerodynamics.coefficient_table import (
    coefficients,
    trim_of,
)
from host.sysid.aerodynamics.thrust_terms import with_thrust
from host.sysid.errors.surface_motion import (
    HELD,
    HELD_SURFACES,
    LINES,
    SERVOS,
    between_samples,
    with_moving_surfaces,
)
from host.sysid.errors.trim_departure import (
    NO_SPIN,
    Departure,
    correct_trim_departure,
    spin_of,
)
from host.sysid.errors.widest_errors import widest_errors
from host.sysid.estimators.filter_error_gust import gust_parameters
from host.sysid.estimators.gust_model import VANES
from host.sysid.estimators.gust_penetration import without_gust_penetration
from host.sysid.estimators.method_registry import fit, refuse_unless_finite
from host.sysid.estimators.users_model import fit_by_evidence, fit_users_model
from host.sysid.flight.filter_step import with_filter_step
from host.sysid.flight.fitted_maneuvers import (
    columns_of,
    fitted_and_held_out,
)
from host.sysid.flight.reconstructed_flight import (
    FlownManeuver,
    ReconstructedFlight,
)
from host.sysid.linear.commanded_surfaces import brought_behind, servo_of
from host.sysid.linear.first_departures import first_departures, remove_departures
from host.sysid.linear.gust_at_trim import fit_gust_at_trim
from host.sysid.linear.left_out_motion import fit_beside_left_out, unaccounted_motion
from host.sysid.linear.linear_answer import Answer
from host.sysid.linear.linear_intervals import linear_intervals
from host.sysid.linear.linear_model import (
    AXIS_OF,
    DEFAULT_METHOD,
    GUST,
    model_and_method,
    standard_delays,
)
from host.sysid.linear.linear_stages import LinearEstimate, LinearIntervals, LinearValidation
from host.sysid.linear.linear_validation import linear_validation
from host.sysid.maneuvers.maneuver_selection import excited_axes
from host.sysid.models.diagnostics import (
    assess_identifiability,
    collinearity,
    constant_inputs,
)
from host.sysid.models.fit_result import FitResult, without_parameters
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.modal_analysis import modes
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim
from host.sysid.reconstruction.sensor_corrections import corrections

FREE = ("output", "innovation")  # residuals of methods that simulate


@dataclass(frozen=True)
class LinearEstimator:
    """One linear model by one method, in the stages of the pipeline.

    Attributes
    ----------
    template : str
        A template's name; of a model of the user's own what it is called in messages.
    own : LinearModel, optional
        Fit this in place of a template, to every maneuver where one of its inputs moved.
    method : str
    airframe : AirframeData, optional
        Gives coefficients.
    powerplant : Powerplant, optional
        Gives the rotor's spin.
    named : bool
        The user asked for this model: a stretch given is a maneuver of it, whatever moved more.
    options : mapping
        Of the method, as keyword arguments of its function.
    """

    template: str
    own: LinearModel | None = None
    method: str = DEFAULT_METHOD
    airframe: AirframeData | None = None
    powerplant: Powerplant | None = None
    named: bool = False
    options: Mapping[str, object] = field(default_factory=dict)

    def estimate(self, flights: Sequence[ReconstructedFlight]) -> LinearEstimate:
        """Fit the model to the maneuvers of its axes, the last of an axis held out.

        Raises
        ------
        IdentificationError
            If there is no such maneuver, a column is missing, or the fit does not come about.
        """
        own = self.own
        flights = [replace(f, corrected=with_thrust(f.corrected, self.powerplant)) for f in flights]
        axes = AXIS_OF[self.template] if own is None else excited_axes(own.inputs)
        named = self.named or own is not None
        used, held = fitted_and_held_out(flights, axes, self.template, named=named)
        trim, condition = trim_of(columns_of(used))
        model, method, remarks = model_and_method(used, trim, self.template, self.method, own)
        gusty = (
            method == GUST
            and self.own is None
            and trim.known
            and bool(set(model.states) & set(VANES))
        )
        departures = self._first_departures(model, used, trim)
        servo, remark = servo_of(model, used, trim.airspeed_mps if gusty else None, departures)
        if servo is not None:
            remarks += (remark,) if remark else ()
            used, held = brought_behind(used, servo.setting), brought_behind(held, servo.setting)
        if method == GUST and self.own is None:
            used = with_filter_step(used, model)
        motion = LINES
        if self.own is None:
            motion = between_samples(used, model, trim, behind=servo is not None)
        if motion == SERVOS:
            used, held = with_moving_surfaces(used), with_moving_surfaces(held)
        elif motion == HELD:
            model = replace(model, hold="zoh")
            remarks += (HELD_SURFACES,)
        data = [m.cut(model) for m in used]
        cuts, departing = [m.inside() for m in used], [m.departing() for m in used]
        spin = spin_of(self.powerplant, departing) if self.own is None else NO_SPIN
        delays: dict[str, tuple[float, float]] = {}
        fitted = beside = said = None
        single = "output-error-white" if method == GUST and not gusty else method
        single_start: dict[str, object] = (
            {"multiple_starts": False} if single.startswith("output-error") else {}
        )
        options = {**single_start, **self.options}
        if own is None and (gusty or single.startswith("output-error")):
            beside = fit_beside_left_out(
                single, model, data, departing, trim, self.airframe, spin, options,
                by_evidence=self.method == DEFAULT_METHOD,
            )  # fmt: skip
        if beside is not None:
            found, model, method = beside.result, beside.model, GUST if beside.in_gusts else method
            data, delays = list(beside.maneuvers), beside.delays
        elif gusty:
            staged, data, said = fit_gust_at_trim(model, data, cuts, trim, self.airframe, spin)
            found, model, delays = staged.result, staged.model, staged.delays
            fitted = list(staged.maneuvers)
        elif own is not None:
            speed = trim.airspeed_mps if trim.known else None
            by = (
                fit_by_evidence(model, data, speed)
                if method == DEFAULT_METHOD
                else fit_users_model(method, model, data, speed, self.options)
            )
            found, method, delays, data = by.result, by.method, by.delays, list(by.maneuvers)
            model, remarks = found.model, (*remarks, *by.remarks)
        else:
            fitted = remove_departures(data, departures)
            found = fit(single, model, fitted, **options)
            both = list(zip(found.fitted, departures, strict=True))
            if all(y.shape == gone.shape for y, gone in both):  # of frequencies they are others
                said = tuple(y + gone for y, gone in both)
        # The start of a gust filter that was lost may have run away: M_alpha -57 000 of one point.
        refuse_unless_finite(found, found.method)
        found = found if servo is None else servo.added_to(found)
        left = None
        if beside is not None:
            left = beside.departure
        elif trim.known and self.own is None and found.residual_kind in FREE:
            left = correct_trim_departure(found, data, departing, self.airframe, trim, spin, fitted)
        return LinearEstimate(
            template=self.template if self.own is None else model.name,
            method=method,
            model=model,
            trim=trim,
            condition=condition,
            used=tuple(used),
            held_out=tuple(held),
            maneuvers=tuple(data),
            cuts=tuple(cuts),
            fit=found,
            departure=left,
            delays=delays,
            fitted=found.fitted if said is None else said,
            servo=servo,
            left_out=() if self.own else unaccounted_motion(model, left, beside),
            remarks=remarks,
        )

    def _first_departures(
        self, model: LinearModel, used: Sequence[FlownManeuver], trim: Trim
    ) -> list[Array]:
        """Return the departures (`first_departures`) where an angle is hidden; zeros with vanes."""
        angles = set(model.states) & set(VANES)
        hidden = any(m.flight.angles is not None or angles - set(m.flight.corrected) for m in used)
        bare = replace(model, delays=())

        def departure_of(
            rough: FitResult, data: Sequence[Maneuver], cuts: Sequence[Mapping[str, Array]]
        ) -> Departure | None:
            spin = spin_of(self.powerplant, cuts)
            return correct_trim_departure(rough, data, cuts, self.airframe, trim, spin)

        if not hidden or not trim.known or self.own is not None:
            return [np.zeros_like(m.cut(bare).outputs) for m in used]
        return first_departures(bare, used, departure_of)

    def intervals(self, estimate: LinearEstimate) -> LinearIntervals:
        """Return the covariance from noise and repeats, and from every systematic error."""
        own = self.own is not None
        return linear_intervals(estimate, self.airframe, self.powerplant, own=own)

    def validation(self, estimate: LinearEstimate, intervals: LinearIntervals) -> LinearValidation:
        """Simulate the model freely over the maneuvers fitted and those held out."""
        return linear_validation(estimate, intervals, self.own)

    def answer(
        self, estimate: LinearEstimate, intervals: LinearIntervals, validation: LinearValidation
    ) -> Answer:
        """Return the parts of all stages as one answer, judged."""
        e, model = estimate, estimate.model
        statistical = intervals.statistical
        gusts: list[str] = []  # what they do is no derivative
        if e.method == GUST:  # a user may name a parameter of his gust_..., and keeps it
            model = without_gust_penetration(model)
            gusts = gust_parameters(statistical)
        result = without_parameters(statistical, model, gusts, intervals.total)
        kept = np.array([name not in gusts for name in statistical.names])
        carrier = e.used[0].flight.compatibility
        return Answer(
            template=e.template,
            method=e.method,
            model=model,
            trim=e.trim,
            thrust=None if e.departure is None else e.departure.thrust,
            condition=e.condition,
            maneuvers=e.maneuvers,
            used=tuple(m.found for m in e.used),
            held_out=tuple(m.found for m in e.held_out),
            result=result,
            fits=validation.fits,
            validation=validation.held_out,
            identifiability_flags=assess_identifiability(result, e.maneuvers).flags,
            collinearity=collinearity(statistical, gusts),
            modes=modes(result),
            coefficients=() if intervals.parts is None else coefficients(intervals.parts),
            coefficient_parts=intervals.parts,
            constant_inputs=constant_inputs(e.model, e.maneuvers),
            delays=e.delays,
            servo=e.servo,
            corrections=() if carrier is None else corrections(carrier),
            simulated=validation.simulated,
            own_model=self.own is not None,
            coherence=intervals.coherence,
            predictions=validation.predictions,
            explained=validation.explained,
            held_out_runs=validation.held_out_runs,
            noise_covariance=statistical.covariance[np.ix_(kept, kept)],
            left_out=e.left_out,
            standard_delays=standard_delays(e.used),
            causes=widest_errors(e.fit, intervals.statistical, intervals.total, intervals.shifts),
        )
