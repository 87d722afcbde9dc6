"""Intervals of a linear model: noise and repeats, then every systematic error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.instrument.deviations import airspeed_share, dynamic_pressure_share, unknown_sensors
from host.instrument.error_sources import AIRCRAFT_FILE, ErrorSource, error_sources
from host.instrument.instrument_errors import usual_errors
from host.sysid.aerodynamics.coefficient_table import (
    CoefficientParts,
    ShiftedEstimate,
    coefficient_parts,
)
from host.sysid.aerodynamics.path_thrust import path_thrust
from host.sysid.errors.airspeed_tolerance import AIRSPEED, airspeed_shift
from host.sysid.errors.column_noise import column_noise
from host.sysid.errors.sampling_error import hold_shift
from host.sysid.errors.surface_motion import motion_shift, surfaces_known
from host.sysid.errors.systematic_errors import (
    add_systematic_covariance,
    errors_left_open,
    systematic_error_shifts,
    systematic_residuals,
)
from host.sysid.estimators.coherence_inflation import driven_by_inputs, widened_to
from host.sysid.linear.linear_stages import LinearEstimate, LinearIntervals
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.uncertainty import Uncertainty
from host.sysid.numerics.input_coherence import InputCoherence, input_coherence
from host.sysid.numerics.joint_noise import noise_of_outputs
from host.sysid.numerics.maneuver_agreement import disagreement, maneuver_agreement
from host.sysid.numerics.score_variance import white_fit_covariance
from host.sysid.reconstruction.flight_path import PITOT
from host.sysid.reconstruction.reconstruction import Compatibility
from host.sysid.reconstruction.sensor_corrections import DENSITY
from host.sysid.reconstruction.sensor_dynamics import DELAYED_COLUMNS, IMU_DELAY, SERVO_DELAY
from host.sysid.validation.free_simulation import FreeResponses, free_responses
from host.sysid.validation.noise_model_limits import excess_over_noise_model

WHITE = "output error (white)"  # its noise is judged without what the inputs drive


def linear_intervals(estimate: LinearEstimate, powerplant: Powerplant | None) -> LinearIntervals:
    """Return the covariance from noise and repeats, and from every systematic error.

    Parameters
    ----------
    estimate : LinearEstimate
    powerplant : Powerplant or None
        Gives the thrust that turns with the aircraft.
    """
    e = estimate
    statistical, coherence = _statistical(e)
    shifts = _shifts(e, statistical)
    airframe, condition = e.columns.airframe, e.columns.chosen.condition
    found: CoefficientParts | None = None
    if airframe is not None and e.trim.known:
        instrument = e.columns.used[0].flight.instrument
        errors = None if instrument is None else instrument.errors
        thrust = path_thrust(e.columns.cuts, powerplant, airframe, e.trim, condition)
        found = coefficient_parts(statistical, airframe, condition, shifts, errors, thrust)
    return LinearIntervals(
        statistical,
        coherence,
        shifts,
        _error_sources(e, shifts, found),
        add_systematic_covariance(statistical, shifts),
        found,
    )


def _statistical(e: LinearEstimate) -> tuple[FitResult, InputCoherence | None]:
    """Return the estimate at its trim, and what the inputs drive outside the model.

    Noise and what the model lacks are in its covariance.
    """
    at_trim = e.at_trim(e.estimate)  # airspeed that varied is known: what it does is no model error
    free = free_responses(e.found.model, e.estimate, at_trim)
    errors = [] if free is None else _known_errors(e, free)
    coherence = None
    if free is not None:
        coherence = input_coherence(free.problem, free.responses, free.theta, nuisance=errors)
    known = _with_model_error(e, _noise(e, free, errors), free, coherence)
    result = replace(
        e.fit,
        estimate=e.estimate,
        covariance=known.covariance,
        degrees_of_freedom=known.degrees_of_freedom,
        fitted=e.found.fitted,
        warnings=(*e.warnings, *known.warnings),
        details=dict(known.details),
    )
    return result, coherence


def _noise(e: LinearEstimate, free: FreeResponses | None, errors: Sequence[Array]) -> Uncertainty:
    """Return what noise leaves open: of the method, with a memory, and of columns that drive."""
    known = replace(e.noise, warnings=())
    # Before maneuvers are compared: by noise without memory a gust made them disagree.
    if free is not None and e.fit.method == WHITE:
        noise = noise_of_outputs(free.problem, free.responses, free.theta, errors)
        known = widened_to(known, white_fit_covariance(free.problem, free.responses, noise))
    return known.plus(column_noise(e.fit, e.found.maneuvers, e.trim))


def _with_model_error(
    e: LinearEstimate,
    noise: Uncertainty,
    free: FreeResponses | None,
    coherence: InputCoherence | None,
) -> Uncertainty:
    """Return noise, and what the model lacks by two tests."""
    scatter = maneuver_agreement(e.fit.model.parameter_names, noise)
    excess = None if free is None else excess_over_noise_model(free, e.fit, e.trim.airspeed_mps)
    return noise.with_model_error(
        [disagreement(scatter), driven_by_inputs(e.fit, noise, coherence, excess)]
    )


def _known_errors(e: LinearEstimate, free: FreeResponses) -> list[Array]:
    """Return what one deviation of each error of the sensors changes of the residuals."""
    known = [c for c in _carriers(e) if c is not None]
    if len(known) < len(e.columns.used):
        return []
    return systematic_residuals(free.problem, free.theta, e.columns.cuts, known, e.trim)


def _carriers(e: LinearEstimate) -> list[Compatibility | None]:
    """Return what is known of the sensors of each maneuver."""
    flights = [m.flight for m in e.columns.used]
    return [f.compatibility or f.calibration_alone or f.by_default for f in flights]


def _shifts(e: LinearEstimate, statistical: FitResult) -> tuple[ShiftedEstimate, ...]:
    """Return the estimate moved by one deviation of every systematic error."""
    # What was fitted in addition to the model would pass for what is open of sensors and surfaces.
    extended = e.departure is not None and bool(e.departure.nuisance)
    fitted = e.at_trim(e.estimate) if extended else list(e.found.maneuvers)
    return (
        *(() if e.departure is None else e.departure.remainders),
        *_by_sensors(e, statistical, fitted),
        *_by_airspeed(e, statistical, fitted),
        *_by_motion(e, statistical, fitted),
    )


def _error_sources(
    e: LinearEstimate, shifts: Sequence[ShiftedEstimate], parts: CoefficientParts | None
) -> tuple[ErrorSource, ...]:
    """Return the errors of the list that widen derivatives or coefficients."""
    counted = {shift.error for shift in shifts}
    found: dict[str, ErrorSource] = {}
    for known, cut in zip(_carriers(e), e.columns.cuts, strict=True):
        for one in () if known is None else errors_left_open(known, cut):
            if one.name in counted and one.deviation > getattr(found.get(one.name), "deviation", 0):
                found[one.name] = one
    instrument = e.columns.used[0].flight.instrument or unknown_sensors()
    sizes = {AIRSPEED: _airspeed_share(e)} if AIRSPEED in counted else {}
    stated: dict[str, float] = {}
    if parts is not None and (a := e.columns.airframe) is not None:
        pitots = dynamic_pressure_share(instrument.errors, e.columns.chosen.condition.qbar_pa)
        sizes |= {"pitot_scale": pitots} if "pitot_scale" in parts.assumed else {}
        stated = dict.fromkeys(("ixx_share", "iyy_share", "izz_share"), a.inertia_share)
        stated |= {"mass_share": a.mass_share, "upwash_share": a.upwash_share}
    origins = dict.fromkeys(stated, AIRCRAFT_FILE)
    return (*found.values(), *error_sources(sizes | stated, instrument, origins))


def _airspeed_share(e: LinearEstimate) -> float:
    """Return one deviation of the scale of an airspeed that nobody calibrated."""
    first = e.columns.used[0].flight
    usual = first.errors or usual_errors(first.maker)
    return airspeed_share(usual, e.columns.chosen.condition.qbar_pa)


def _by_sensors(
    e: LinearEstimate, statistical: FitResult, fitted: Sequence[Maneuver]
) -> tuple[ShiftedEstimate, ...]:
    """Return what errors do that an aircraft file or a calibration names."""
    carriers = _carriers(e)
    known = [c for c in carriers if c is not None]
    if len(known) < len(carriers):
        return ()
    # Servos that were estimated leave what is open of them in the covariance, and the IMU's delay
    # with it: all outputs later are all inputs earlier.
    estimated = {SERVO_DELAY, IMU_DELAY} if e.columns.servo is not None else set()
    estimated |= DELAYED_COLUMNS.keys() if e.found.delays else set()
    # Without a file the airspeed's error is one, of which the data tell a part: `_by_airspeed`.
    estimated |= {*PITOT, DENSITY} if e.columns.airframe is None and e.trim.known else set()
    moved = systematic_error_shifts(statistical, fitted, e.columns.cuts, known, e.trim)
    return tuple(s for s in moved if s.error not in estimated)


def _by_airspeed(
    e: LinearEstimate, statistical: FitResult, fitted: Sequence[Maneuver]
) -> tuple[ShiftedEstimate, ...]:
    """Return what an airspeed does that nobody calibrated."""
    if e.columns.airframe is not None:
        return ()
    return airspeed_shift(statistical, fitted, e.trim, _airspeed_share(e))


def _by_motion(
    e: LinearEstimate, statistical: FitResult, fitted: Sequence[Maneuver]
) -> tuple[ShiftedEstimate, ...]:
    """Return what inputs do between their samples."""
    chosen, used = e.columns.chosen, e.columns.used
    held = chosen.own or e.found.model.hold == "zoh"
    # Delays that were estimated have taken up half a sample, and their intervals count it.
    if not held and (surfaces_known(used) or e.found.delays):
        return motion_shift(statistical, fitted, used, e.trim)
    return hold_shift(statistical, fitted, e.trim)
