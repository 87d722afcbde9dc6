"""Linear models of a flight: estimation, intervals, validation, each a stage that adds its part.

A stage hands on what it made; none changes what an earlier one said. `LinearEstimator` is what the
pipeline runs, `identify` the same for columns that are at hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData
from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.instrument.deviations import airspeed_share
from host.instrument.instrument_errors import InstrumentErrors, usual_errors
from host.instrument.recording import OWN
from host.sysid.aerodynamics.coefficient_table import (
    Coefficient,
    CoefficientParts,
    ShiftedEstimate,
    coefficient_parts,
    coefficients,
    trim_of,
)
from host.sysid.aerodynamics.path_thrust import path_thrust
from host.sysid.compatibility.reconstruction import Compatibility
from host.sysid.compatibility.sensor_corrections import corrections
from host.sysid.compatibility.sensor_dynamics import IMU_DELAY, SERVO_DELAY
from host.sysid.estimators.coherence_inflation import inflate_by_coherence, widened_to
from host.sysid.estimators.filter_error_gust import (
    GustFit,
    fit_with_gust,
    without_gust_parameters,
)
from host.sysid.estimators.gust_delays import advance_outputs
from host.sysid.estimators.gust_model import VANES
from host.sysid.estimators.gust_penetration import (
    with_unknown_roll_lag,
    without_gust_penetration,
)
from host.sysid.estimators.method_registry import fit, refuse_unless_finite
from host.sysid.estimators.missing_control import missing_control, widened_by_missing_control
from host.sysid.estimators.users_model import fit_by_evidence, fit_users_model
from host.sysid.flight.airspeed_tolerance import airspeed_shift
from host.sysid.flight.column_noise import with_column_noise
from host.sysid.flight.commanded_surfaces import brought_behind, servo_of
from host.sysid.flight.estimator import answer_of
from host.sysid.flight.filter_step import (
    feels_roll,
    others_recorded,
    rolling_gust_identifiable,
    sensors_known,
    with_filter_step,
)
from host.sysid.flight.first_departures import first_departures, remove_departures
from host.sysid.flight.free_simulation import (
    fits_of,
    free_responses,
    free_simulation,
    frozen_model,
)
from host.sysid.flight.linear_answer import Answer
from host.sysid.flight.linear_model import (
    AXIS_OF,
    DEFAULT_METHOD,
    GUST,
    fitted_template,
    frees_places,
    with_drag_arm,
    without_attitude,
)
from host.sysid.flight.linear_stages import LinearEstimate, LinearIntervals, LinearValidation
from host.sysid.flight.maneuver_detection import DetectedManeuver, Grade, detect_maneuvers, grade
from host.sysid.flight.maneuver_selection import HELD_OUT_FROM, excited_axes, joined_windows
from host.sysid.flight.noise_model_limits import excess_over_noise_model
from host.sysid.flight.prediction_limits import Prediction, driven_states, predictions
from host.sysid.flight.reconstructed_flight import (
    FlownManeuver,
    ReconstructedFlight,
    flown_maneuvers,
    reconstruct_flight,
)
from host.sysid.flight.sampling_error import hold_shift, kink_shift, with_moving_surfaces
from host.sysid.flight.systematic_errors import add_systematic_covariance, systematic_error_shifts
from host.sysid.flight.trim_departure import (
    NO_SPIN,
    Departure,
    correct_trim_departure,
    spin_of,
)
from host.sysid.flight.widest_errors import widest_errors
from host.sysid.identification_error import IdentificationError
from host.sysid.models.diagnostics import (
    assess_identifiability,
    collinearity,
    constant_inputs,
)
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.modal_analysis import modes
from host.sysid.models.residual_delays import (
    delays_of,
    without_standard_delays,
)
from host.sysid.models.state_space_model import DelayGroup, LinearModel
from host.sysid.models.templates import Trim
from host.sysid.numerics.input_coherence import input_coherence
from host.sysid.numerics.maneuver_agreement import inflate_covariance, maneuver_agreement
from host.sysid.numerics.score_variance import white_fit_variance


class NoManeuverError(IdentificationError):
    """No maneuver that a model could be fitted to."""


FREE = ("output", "innovation")  # residuals of methods that simulate
WHITE = "output error (white)"  # its noise is judged beside what the inputs drive
WEAK_GRADE = 0.2


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
        used, held = self._maneuvers(flights)
        trim, condition = trim_of(_maneuver_columns(used))
        model, method, remarks = self._model(used, trim)
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
        if self.own is None and sensors_known(used):
            used, held = with_moving_surfaces(used), with_moving_surfaces(held)
        data = [m.cut(model) for m in used]
        cuts, departing = [m.inside() for m in used], [m.departing() for m in used]
        spin = spin_of(self.powerplant, departing) if self.own is None else NO_SPIN
        delays: dict[str, tuple[float, float]] = {}
        fitted = None
        if gusty:
            staged, data, fitted = self._with_gust(model, data, cuts, trim, spin)
            found, model, delays = staged.result, staged.model, staged.delays
        elif self.own is not None:
            speed = trim.airspeed_mps if trim.known else None
            by = (
                fit_by_evidence(model, data, speed)
                if method == DEFAULT_METHOD
                else fit_users_model(method, model, data, speed, self.options)
            )
            found, method, delays, data = by.result, by.method, by.delays, list(by.maneuvers)
            model, remarks = found.model, (*remarks, *by.remarks)
        else:
            single = "output-error-white" if method == GUST else method
            single_start: dict[str, object] = (
                {"multiple_starts": False} if single.startswith("output-error") else {}
            )
            fitted = remove_departures(data, departures)
            found = fit(single, model, fitted, **{**single_start, **self.options})
            both = list(zip(found.fitted, departures, strict=True))
            if all(y.shape == gone.shape for y, gone in both):  # of frequencies they are others
                found = replace(found, fitted=tuple(y + gone for y, gone in both))
        # The start of a gust filter that was lost may have run away: M_alpha -57 000 of one point.
        refuse_unless_finite(found, found.method)
        found = found if servo is None else servo.added_to(found)
        found = replace(found, warnings=(*remarks, *found.warnings))
        left = None
        if trim.known and self.own is None and found.residual_kind in FREE:
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
            servo=servo,
        )

    def _first_departures(
        self, model: LinearModel, used: Sequence[FlownManeuver], trim: Trim
    ) -> list[Array]:
        """Return the departures (`first_departures`) where an angle is hidden; zeros with vanes."""
        hidden = any(m.flight.angles is not None for m in used)
        bare = replace(model, delays=())

        def departure_of(
            rough: FitResult, data: Sequence[Maneuver], cuts: Sequence[Mapping[str, Array]]
        ) -> Departure | None:
            spin = spin_of(self.powerplant, cuts)
            return correct_trim_departure(rough, data, cuts, self.airframe, trim, spin)

        if not hidden or not trim.known or self.own is not None:
            return [np.zeros_like(m.cut(bare).outputs) for m in used]
        return first_departures(bare, used, departure_of)

    def _with_gust(
        self,
        model: LinearModel,
        data: Sequence[Maneuver],
        cuts: Sequence[Mapping[str, Array]],
        trim: Trim,
        spin: tuple[float, float],
    ) -> tuple[GustFit, list[Maneuver], list[Maneuver]]:
        """Fit with the gust as a state, departures from the trim removed at a first such fit.

        One step behind the fit does not do: in calm air the IMU seemed 0.3 ms late by what the
        drag polar does to ax, and M_q was 1.8 % off. Nor does output error in front of it: in
        gusts of 1 m/s its M_alpha was up to six times too large.

        Returns
        -------
        GustFit, list of Maneuver, list of Maneuver
            The fit, and the maneuvers without delays: as measured, and as fitted.
        """
        bare = replace(model, delays=())
        rough = fit_with_gust(bare, data, trim.airspeed_mps, roughly=True).result
        at_trim, before = list(data), None
        if rough.residual_kind == "innovation":
            departure = correct_trim_departure(rough, data, cuts, self.airframe, trim, spin)
            before = rough if departure is None else departure.corrected(rough)
            if departure is not None:
                at_trim = departure.removed_from(data, before.estimate)
        staged = fit_with_gust(model, at_trim, trim.airspeed_mps, before)
        delays_s = {name: value for name, (value, _) in staged.delays.items()}
        measured = [advance_outputs(m, model, delays_s) for m in data]
        # What the fit says of the data as measured, departures with it.
        fitted = tuple(
            y + m.outputs - still.outputs
            for y, m, still in zip(staged.result.fitted, measured, staged.maneuvers, strict=True)
        )
        staged = replace(staged, result=replace(staged.result, fitted=fitted))
        return staged, measured, list(staged.maneuvers)

    def intervals(self, estimate: LinearEstimate) -> LinearIntervals:
        """Return the covariance from noise and repeats, and from every systematic error."""
        e = estimate
        fit_at_trim = e.fit if e.departure is None else e.departure.corrected(e.fit)
        statistical = fit_at_trim
        # Airspeed that varied is known: what it does is no model error.
        at_trim = e.at_trim(e.estimate)
        free = free_responses(e.model, e.estimate, at_trim)
        coherence = excess = None
        if free is not None:
            coherence = input_coherence(free.problem, free.responses, free.theta)
            excess = excess_over_noise_model(free, statistical, e.trim.airspeed_mps)
            # Before maneuvers are compared: by noise without memory a gust made them disagree.
            if statistical.method == WHITE:
                statistical = widened_to(
                    statistical,
                    white_fit_variance(
                        free.problem,
                        free.responses,
                        coherence.noise,
                        coherence.innovation_variance,
                    ),
                )
        statistical = with_column_noise(statistical, e.maneuvers, e.trim)
        noisy = statistical if e.departure is None else e.departure.with_airspeed_noise(statistical)
        statistical = inflate_covariance(statistical, maneuver_agreement(noisy))
        statistical = inflate_by_coherence(statistical, coherence, excess)
        absent = missing_control(e.fit, at_trim, e.trim.airspeed_mps)
        statistical = widened_by_missing_control(statistical, absent)
        # Behind what a model error multiplies: this noise is known.
        if e.departure is not None:
            statistical = e.departure.with_airspeed_noise(statistical)
        # Our own log is fitted in means, which lean less on what the gust is between samples.
        if others_recorded(e.used):
            statistical = with_unknown_roll_lag(statistical)
        shifts: tuple[ShiftedEstimate, ...] = () if e.departure is None else e.departure.remainders
        carriers = [m.flight.compatibility for m in e.used]
        known = [c for c in carriers if c is not None]
        if len(known) == len(carriers):
            moved = systematic_error_shifts(statistical, e.maneuvers, e.cuts, known, e.trim)
            # Of servos that were estimated the covariance has what they leave open, and the IMU's
            # delay with it: all outputs later are all inputs earlier.
            estimated = () if e.servo is None else (SERVO_DELAY, IMU_DELAY)
            shifts += tuple(s for s in moved if s.error not in estimated)
        if self.airframe is None:
            first = e.used[0].flight
            usual = first.errors or usual_errors(first.maker)
            share = airspeed_share(usual, e.condition.qbar_pa)
            shifts += airspeed_shift(statistical, e.maneuvers, e.trim, share)
        # Delays that were estimated have taken up half a sample, and their intervals count it.
        if self.own is None and sensors_known(e.used):
            shifts += kink_shift(statistical, e.maneuvers, e.used, e.trim)
        elif self.own is not None or not e.delays:
            shifts += hold_shift(statistical, e.maneuvers, e.trim)
        found: CoefficientParts | None = None
        if self.airframe is not None and e.trim.known:
            own = e.used[0].flight.instrument
            errors = own.errors if own is not None else None
            thrust = path_thrust(e.cuts, self.powerplant, self.airframe, e.trim, e.condition)
            found = coefficient_parts(
                statistical, self.airframe, e.condition, shifts, errors, thrust
            )
        return LinearIntervals(
            statistical, coherence, shifts, add_systematic_covariance(statistical, shifts), found
        )

    def validation(self, estimate: LinearEstimate, intervals: LinearIntervals) -> LinearValidation:
        """Simulate the model freely over the maneuvers fitted and those held out."""
        e, total = estimate, intervals.total
        # Of frequencies the residuals are not those of samples.
        ours = total.residual_kind == "output" and all(
            y.shape == m.outputs.shape for y, m in zip(total.fitted, e.maneuvers, strict=True)
        )
        same = ours and not intervals.shifts
        frozen = frozen_model(e.model, total)
        simulated = (
            list(total.fitted)
            if same
            else _simulated(frozen, e.maneuvers, e.at_trim(total.estimate))
        )
        late = delays_of(e.model.outputs) if self.own is None else self.own.delays
        held_out = [_without_delays(m.cut(e.model), e.model, late, e.delays) for m in e.held_out]
        at_trim = (
            held_out
            if e.departure is None
            else e.departure.removed_from_held_out(
                held_out, [m.departing() for m in e.held_out], total.estimate
            )
        )
        held_out_runs = _simulated(frozen, held_out, at_trim)
        explained: dict[str, Prediction] = {}
        if driven_states(e.model, total):
            explained = predictions(e.model, total, intervals.coherence, e.maneuvers, simulated)
        return LinearValidation(
            tuple(simulated),
            fits_of(e.model, e.maneuvers, simulated),
            fits_of(e.model, held_out, held_out_runs),
            predictions(e.model, total, intervals.coherence, held_out, held_out_runs),
            tuple(zip(held_out, held_out_runs, strict=True)),
            explained,
        )

    def answer(
        self, estimate: LinearEstimate, intervals: LinearIntervals, validation: LinearValidation
    ) -> Answer:
        """Return the parts of all stages as one answer, judged."""
        e, model = estimate, estimate.model
        total, statistical = intervals.total, intervals.statistical
        if e.method == GUST:  # a user may name a parameter of his gust_..., and keeps it
            model = without_gust_penetration(model)
            total, statistical = (without_gust_parameters(r, model) for r in (total, statistical))
        carrier = e.used[0].flight.compatibility
        return Answer(
            template=e.template,
            method=e.method,
            model=model,
            trim=e.trim,
            condition=e.condition,
            maneuvers=e.maneuvers,
            used=tuple(m.found for m in e.used),
            held_out=tuple(m.found for m in e.held_out),
            result=total,
            fits=validation.fits,
            validation=validation.held_out,
            identifiability_flags=assess_identifiability(total, e.maneuvers).flags,
            collinearity=collinearity(statistical),
            modes=modes(total),
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
            noise_covariance=statistical.covariance,
            causes=widest_errors(e.fit, intervals.statistical, intervals.total, intervals.shifts),
        )

    def _maneuvers(
        self, flights: Sequence[ReconstructedFlight]
    ) -> tuple[list[FlownManeuver], list[FlownManeuver]]:
        """Return the maneuvers to fit and those to hold out."""
        every = [f for flight in flights for f in flight.maneuvers]
        if not every:
            raise NoManeuverError(
                "no maneuver found: no surface moved by more than 1.4 degrees at once; give"
                " argument from_s and argument to_s, or fly a doublet or 3-2-1-1 of 3 degrees or"
                " more"
            )
        axes = AXIS_OF[self.template] if self.own is None else excited_axes(self.own.inputs)
        named = self.named or self.own is not None
        mine = flown_maneuvers(
            flights,
            joined_windows(
                [[f for f in x.maneuvers if f.axis in axes or (f.given and named)] for x in flights]
            ),
        )
        # The order in which flights are given shall not choose the maneuver that is held out.
        mine.sort(key=lambda m: [(f.start_s, f.end_s, f.amplitude) for f in m.flight.maneuvers])
        if not mine:
            given = "; argument models names it all the same" if every[0].given else ""
            raise NoManeuverError(
                f"no maneuver of {', '.join(axes)} for {self.template}; found"
                f" only {', '.join(sorted({f.axis for f in every}))}{given}"
            )
        good = [
            m
            for m in mine
            if m.found.given or grade(m.flight.corrected, m.found).score >= WEAK_GRADE
        ] or mine
        held = _held_out([m for m in good if not m.found.given])
        return [m for m in good if m not in held], [
            replace(m, found=m.found.response()) for m in held
        ]

    def _model(
        self, used: Sequence[FlownManeuver], trim: Trim
    ) -> tuple[LinearModel, str, tuple[str, ...]]:
        """Return the model to fit, the method that the default one comes to, and remarks."""
        if self.method == GUST and self.own is None and not trim.known:
            raise IdentificationError(
                f"{GUST} needs airspeed_mps, which tells how fast gusts pass; give another method"
            )
        flight = used[0].flight
        free = frees_places(self.method)
        able = free and all(m.flight.delays_open for m in used)
        remarks: tuple[str, ...] = ()
        if self.own is None:
            shared = set.intersection(*(set(m.flight.corrected) for m in used))
            model, remarks = fitted_template(
                shared, self.template, used, trim, self.method, able=able
            )
        else:
            model = self.own if able else without_standard_delays(self.own)
        instrument = None if flight.compatibility is None else flight.compatibility.instrument
        if self.own is None and instrument is not None and free:
            model = with_drag_arm(model, trim, instrument)
        method = self.method
        if method == DEFAULT_METHOD and self.own is None:
            # A filter takes the line between two values of a slow sensor for measurements.
            evenly = not any(m.cut(model).held for m in used)
            # Of our own log laterally only where its sensors are known (`filter_step`).
            rolls = feels_roll(model) and rolling_gust_identifiable(used)
            vane = "beta_rad" if rolls else "alpha_rad"
            measured = vane in model.states and vane in model.outputs
            gust = measured and trim.known and evenly
            method = GUST if gust else "output-error-white"
            if method != GUST and self.template == "lateral":
                model = without_attitude(model, used)
        return model, method, remarks


def _simulated(
    frozen: LinearModel, maneuvers: Sequence[Maneuver], at_trim: Sequence[Maneuver]
) -> list[Array]:
    """Return a free simulation, constants fitted at the trim, with the departures from it."""
    return [
        y + m.outputs - still.outputs
        for y, m, still in zip(free_simulation(frozen, at_trim), maneuvers, at_trim, strict=True)
    ]


def _without_delays(
    maneuver: Maneuver,
    model: LinearModel,
    groups: tuple[DelayGroup, ...],
    delays: Mapping[str, tuple[float, float]],
) -> Maneuver:
    if not delays:
        return maneuver
    late = replace(model, delays=groups)
    return advance_outputs(maneuver, late, {name: value for name, (value, _) in delays.items()})


def maneuvers_of(columns: Mapping[str, Array]) -> list[tuple[DetectedManeuver, Grade]]:
    """Return the maneuvers of a flight with their grades."""
    return [(item, grade(columns, item)) for item in detect_maneuvers(columns)]


def identify(
    columns: dict[str, Array],
    *,
    names: Sequence[str] = ("longitudinal", "lateral"),
    method: str = DEFAULT_METHOD,
    airframe: AirframeData | None = None,
    windows: Sequence[DetectedManeuver] | None = None,
    user_model: LinearModel | None = None,
    with_delays: bool = True,
    compatibility: Compatibility | None = None,
    powerplant: Powerplant | None = None,
    maker: str = OWN,
    errors: InstrumentErrors | None = None,
) -> list[Answer]:
    """Fit every model that has maneuvers to the columns of one flight.

    Parameters
    ----------
    columns : dict
        SI columns on an even grid.
    names : sequence of str
        Templates to fit.
    method : str
        A method of `fit`.
    airframe : AirframeData, optional
        Gives sensor corrections and coefficients.
    windows : sequence of Found, optional
        Use these instead of finding them.
    user_model : LinearModel, optional
        Fit this instead of templates, to every window where one of its inputs moved.
    with_delays : bool
        Estimate residual delays and accelerometer offsets where the method can.
    compatibility : Compatibility, optional
        What reconstruction found: told errors are taken out of the columns, and what stays open
        of all errors is carried into the intervals.
    powerplant : Powerplant, optional
        Gives the rotor's spin.
    maker : str
        Who recorded the columns, as `Recording.maker`: lateral motion of others' tables is fitted
        with rolling gusts by default, of ours only where an aircraft file is known.
    errors : InstrumentErrors, optional
        Of the sensors, without an aircraft file; otherwise what is usual of the maker's.

    Raises
    ------
    IdentificationError
        If no maneuver is there for any model.
    """
    strangers = [n for n in names if user_model is None and n not in AXIS_OF]
    if strangers:
        raise IdentificationError(
            f"no template '{strangers[0]}'; there are {', '.join(AXIS_OF)}, or give a TOML file"
        )
    found = detect_maneuvers(columns) if windows is None else windows
    flight = reconstruct_flight(
        columns, found, airframe=airframe, compatibility=compatibility, maker=maker
    )
    flight = replace(flight, delays_open=flight.delays_open and with_delays, errors=errors)
    answers: list[Answer] = []
    failed: list[str] = []
    for name in names:
        estimator = LinearEstimator(name, user_model, method, airframe, powerplant)
        try:
            answers.append(answer_of(estimator, [flight]))
        except NoManeuverError as error:
            failed.append(str(error))
    if not answers:
        raise NoManeuverError("; ".join(dict.fromkeys(failed)))
    return answers


def from_zero(coefficient: Coefficient) -> bool:
    """Return whether a coefficient is told from zero: its interval does not reach it."""
    return abs(coefficient.value) > coefficient.half_width


def _maneuver_columns(used: Sequence[FlownManeuver]) -> dict[str, Array]:
    """Return the corrected columns within the maneuvers, every sample once."""
    kept: dict[str, list[Array]] = {}
    flights = list({id(m.flight): m.flight for m in used}.values())
    for flight in flights:
        t = flight.corrected["t_s"]
        cut = np.zeros(len(t), dtype=bool)
        for m in used:
            if m.flight is flight:
                cut |= (t >= m.found.start_s) & (t <= m.found.end_s)
        for name, values in flight.corrected.items():
            if name != "t_s":
                kept.setdefault(name, []).append(values[cut])
    return {k: np.concatenate(v) for k, v in kept.items() if len(v) == len(flights)}


def _held_out(found: list[FlownManeuver]) -> list[FlownManeuver]:
    """Hold out the last maneuver of every axis that was flown at least three times."""
    held = []
    for axis in dict.fromkeys(m.found.axis for m in found):
        mine = [m for m in found if m.found.axis == axis]
        if len(mine) >= HELD_OUT_FROM:
            held.append(mine[-1])
    return held
