"""Steps of the default path, and what replaces them when each is switched off.

A switch replaces functions by their import path, in the process that runs it alone: the product has
no code for it. `off` is called with the arguments of the function that it stands for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

ROOM = "host.sysid."


@dataclass(frozen=True, slots=True)
class Switch:
    """A step, what it does, and what replaces which functions without it."""

    name: str
    does: str
    off: dict[str, Any]


def gives(value: Any) -> Callable[..., Any]:
    """Return a function that always returns one value."""
    return lambda *_, **__: value


def argument(number: int) -> Callable[..., Any]:
    """Return a function that hands one of its arguments through."""
    return lambda *given, **_: given[number]


def _no_noise(result: Any, *_: Any, **__: Any) -> Any:
    return np.zeros_like(result.covariance)


def _no_first_departures(chosen: Any, *_: Any) -> Any:
    return [0.0 * m.cut(chosen.model).outputs for m in chosen.used]


def _one(name: str, does: str, path: str, off: Any) -> Switch:
    return Switch(name, does, {path: off})


def _straight(found: Any, *_: Any, **__: Any) -> Any:
    return list(found)


def _groups(found: Any) -> Any:
    return [[item] for item in found]


def _no_inflation(known: Any, variance: Any) -> Any:
    return known


def _plain_lowpass(signal: Any, *_: Any, **__: Any) -> Any:
    return signal


def _measured_angle(data: Any, name: str, *_: Any, **__: Any) -> Any:
    return data[name]


def _delayed_vane(angle: Any, tau_s: float, _: Any, columns: Any, __: float) -> Any:
    t = columns["t_s"]
    return np.interp(t + tau_s, t, angle)


def _standing(found: Any, *_: Any, **__: Any) -> Any:
    return found, ()


def _bare(model: Any, _: float, start: Any) -> Any:
    return model, start


def _vane_zero(estimate: Any, *_: Any) -> Any:
    return estimate


SWITCHES = (
    # Maneuvers.
    _one(
        "free response",
        "adds the rest before and the free motion after an input",
        "maneuvers.free_response:with_free_response",
        _straight,
    ),
    _one(
        "sustained inputs",
        "finds multisines and sweeps",
        "maneuvers.sustained_inputs:sustained_inputs",
        gives([]),
    ),
    _one(
        "echoes",
        "drops inputs that follow the attitude or swing faintly next to another",
        "maneuvers.overlapping_inputs:without_echoes",
        _straight,
    ),
    _one(
        "attitude followed",
        "takes a hand that levels for an echo",
        "maneuvers.overlapping_inputs:_follows_attitude",
        gives(False),
    ),
    _one(
        "flown together",
        "gives inputs that overlap one free response",
        "maneuvers.overlapping_inputs:flown_together",
        _groups,
    ),
    _one(
        "logged inputs",
        "takes windows of test inputs from the log",
        "maneuvers.logged_inputs:logged_inputs",
        gives({}),
    ),
    _one(
        "held inputs",
        "joins the edges of an input that is held",
        "maneuvers.maneuver_detection:_join_held",
        argument(0),
    ),
    _one(
        "weak maneuvers",
        "leaves maneuvers of a weak grade out",
        "flight.fitted_maneuvers:_worth_it",
        gives(True),
    ),
    _one(
        "held out",
        "keeps the last maneuver of an axis for validation",
        "flight.fitted_maneuvers:_held_out",
        gives([]),
    ),
    # Reconstruction.
    _one(
        "corrections",
        "removes sensor errors that the flight tells",
        "reconstruction.sensor_corrections:corrections",
        gives(()),
    ),
    _one(
        "vane friction",
        "compensates dry friction of vanes",
        "reconstruction.path_preparation:compensate_friction",
        _measured_angle,
    ),
    _one(
        "low-pass",
        "inverts the low-pass of the IMU",
        "reconstruction.path_preparation:compensate_lowpass",
        _plain_lowpass,
    ),
    _one(
        "vane dynamics",
        "inverts a vane's second order, beyond its delay",
        "reconstruction.sensor_dynamics:invert_vane_dynamics",
        _delayed_vane,
    ),
    _one(
        "standstill",
        "tells zeros of the IMU on the ground",
        "reconstruction.ground_attitude:update_by_standstill",
        _standing,
    ),
    _one(
        "known better",
        "takes the vanes' delay of the file where it is better",
        "reconstruction.reconstruction:_known_better",
        gives(False),
    ),
    _one(
        "IMU and vane",
        "widens the zero of the alpha vane without GPS",
        "reconstruction.reconstruction:_with_imu_errors",
        _vane_zero,
    ),
    _one(
        "step lengths",
        "shortens steps that turn back",
        "reconstruction.path_fit:_length",
        gives(1.0),
    ),
    _one(
        "headings",
        "takes a segment of each quadrant of heading",
        "reconstruction.path_preparation:_of_each_heading",
        gives([]),
    ),
    _one(
        "hidden angles",
        "reconstructs angles that no vane measured",
        "pipeline.flight_preparation:_hidden_angles",
        gives((None, ())),
    ),
    _one(
        "calibration alone",
        "carries the standard errors of sensors without a file",
        "reconstruction.reconstruction:by_calibration_alone",
        gives(None),
    ),
    # Preparation of linear models.
    _one(
        "means for filters",
        "averages our lateral columns to 20 ms",
        "flight.filter_step:with_filter_step",
        _straight,
    ),
    _one(
        "drag arm",
        "frees the height of the accelerometers where drag is fitted",
        "linear.linear_model:with_drag_arm",
        argument(0),
    ),
    _one(
        "bank left out",
        "fits output error without the attitude filter's bank",
        "linear.linear_model:without_attitude",
        argument(0),
    ),
    _one(
        "first departures",
        "removes departures by a white fit where no vane was",
        "linear.first_departures:first_departures",
        _no_first_departures,
    ),
    _one(
        "gusts in reduced",
        "lets reduced templates have the gust where data show it",
        "linear.left_out_motion:_in_gusts",
        gives(None),
    ),
    _one(
        "reduced templates",
        "fits reduced templates with the motion they leave out",
        "linear.left_out_motion:fit_with_left_out",
        gives(None),
    ),
    _one(
        "known no better",
        "widens what reduced templates know of attenuated terms",
        "linear.left_out_motion:_known_no_better",
        argument(0),
    ),
    _one(
        "thrust",
        "fits what measured thrust adds to a template",
        "aerodynamics.thrust_terms:thrust_terms",
        gives(()),
    ),
    _one(
        "terms left out",
        "reckons the motion that reduced templates leave out",
        "aerodynamics.left_out_terms:terms_left_out",
        gives(()),
    ),
    _one(
        "drag polar",
        "estimates the curvature of the drag polar, and drag by pitching, along",
        "errors.trim_departure:_polar",
        gives({}),
    ),
    _one(
        "guess tested",
        "drops departures of guessed columns that the record has not",
        "errors.trim_departure:_guessed_in_vain",
        gives(False),
    ),
    _one(
        "servos estimated",
        "estimates the servos behind commands",
        "linear.commanded_surfaces:servo_of",
        gives((None, "")),
    ),
    _one(
        "held or moving",
        "tells by the data how surfaces move between samples",
        "errors.surface_motion:between_samples",
        gives("as servos do"),
    ),
    _one(
        "moving surfaces",
        "lets surfaces move between samples as servos do",
        "errors.surface_motion:with_moving_surfaces",
        _straight,
    ),
    # The gust filter.
    _one(
        "gust penetration",
        "lets the tail meet a gust later than the vane",
        "estimators.gust_penetration:with_gust_penetration",
        _bare,
    ),
    _one(
        "calm air refused",
        "takes output error where a gust filter finds none",
        "estimators.filter_error_gust:_unfit_in_calm",
        gives(""),
    ),
    _one(
        "what passes for a delay",
        "widens delays by gusts between samples",
        "estimators.gust_delays:_with_what_passes",
        lambda found, *_: (found, found),
    ),
    _one(
        "other starts",
        "searches from more starts where the first fails",
        "estimators.multistart:_from_other_starts",
        argument(2),
    ),
    _one(
        "homotopy",
        "starts searches from a stabilised model",
        "estimators.homotopy:homotopy_start",
        argument(1),
    ),
    # Intervals.
    _one(
        "trial airspeed",
        "lets the data tell the scale of the airspeed",
        "errors.airspeed_tolerance:POSTERIOR_PRIOR_RATIO",
        0.0,
    ),
    _one(
        "airspeed",
        "counts the scale of an airspeed that nobody calibrated",
        "errors.airspeed_tolerance:airspeed_shift",
        gives(()),
    ),
    _one(
        "noise of columns",
        "counts the noise of columns that drive equations",
        "errors.column_noise:column_noise",
        _no_noise,
    ),
    _one(
        "noise with a memory",
        "widens white fits to the noise that they leave",
        "estimators.coherence_inflation:widened_to",
        _no_inflation,
    ),
    _one(
        "maneuvers that differ",
        "widens where maneuvers disagree",
        "numerics.maneuver_agreement:disagreement",
        gives(None),
    ),
    _one(
        "driven by inputs",
        "widens where inputs drive the residual",
        "estimators.coherence_inflation:driven_by_inputs",
        gives(None),
    ),
    _one(
        "excess over noise",
        "widens where free simulation misses more than gusts allow",
        "validation.noise_model_limits:excess_over_noise_model",
        gives(None),
    ),
    _one(
        "errors in residuals",
        "lets the test of residuals know the instrument's errors",
        "errors.systematic_errors:systematic_residuals",
        gives([]),
    ),
    _one(
        "samples held",
        "counts inputs between samples of users' models",
        "errors.sampling_error:hold_shift",
        gives(()),
    ),
    _one(
        "surfaces between samples",
        "counts surfaces between samples",
        "errors.surface_motion:motion_shift",
        gives(()),
    ),
    # Checks of columns.
    _one(
        "feedback",
        "finds surfaces that follow states",
        "checks.feedback_findings:feedback_findings",
        gives([]),
    ),
    _one(
        "calibration",
        "tests sensor errors against their file",
        "checks.agreement_findings:calibration_findings",
        gives([]),
    ),
    _one(
        "no vanes",
        "notes angles that no vane measured",
        "checks.hidden_angles:no_vanes_finding",
        gives([]),
    ),
    _one(
        "driven factors",
        "tests identities in what surfaces drive",
        "checks.driven_motion:driven_factors",
        gives(()),
    ),
    _one(
        "airspeed's unit",
        "tests the airspeed's unit by lift and side force",
        "checks.kinematic_checks:_judge_airspeed",
        gives([]),
    ),
    _one(
        "likelier units",
        "names units that would agree better",
        "checks.kinematic_checks:_judge_units",
        gives([]),
    ),
    _one(
        "usual side forces",
        "holds a side force against what is usual",
        "checks.side_force:unlikely_factors",
        gives({}),
    ),
    _one(
        "unrelated columns",
        "finds columns that follow no identity",
        "checks.kinematic_checks:_unrelated",
        gives(None),
    ),
    _one(
        "opposed forces",
        "tests wind angles against their forces",
        "checks.unit_sign_checks:_forces",
        gives([]),
    ),
    _one(
        "surface signs",
        "tests which way a surface turns the aircraft",
        "checks.unit_sign_checks:_surfaces",
        gives([]),
    ),
    _one(
        "surfaces exchanged",
        "tests whether surfaces drive each other's rate",
        "checks.unit_sign_checks:_exchanged",
        gives([]),
    ),
    _one(
        "readings",
        "reads a column in the unit that it was meant in",
        "checks.unit_readings:reread",
        gives(None),
    ),
    _one(
        "stuck sensors",
        "finds sensors that stand still",
        "checks.stuck_sensors:stuck_runs",
        gives([]),
    ),
    _one(
        "spikes",
        "takes values far out of a column for missing",
        "checks.measured:_without_spikes",
        lambda _, values: (values, []),
    ),
    _one(
        "side force in doubt",
        "leaves a side force with a finding out of linear fits",
        "linear.linear_model:_in_doubt",
        gives(False),
    ),
    _one(
        "small inputs",
        "fits all of a flight in which no maneuver is found",
        "checks.small_inputs:whole_flight",
        gives(([], [])),
    ),
)
