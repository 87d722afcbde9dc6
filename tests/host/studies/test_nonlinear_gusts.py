"""Fits of the twin's aircraft in gusts: what a varying airspeed must not bias."""

import numpy as np
from host.sysid.estimators import fit
from studies.gusts import AXES
from studies.nonlinear_gusts import fly_nonlinear, varying
from studies.turbulence import fit_both, nonlinear_setup


def test_airspeed_off_the_trim_biases_no_moment() -> None:
    """Torque of the propeller does not follow V^2; without its terms Cn_r is 4 % off."""
    flight = fly_nonlinear("lateral", 0.0, [3], with_pilot=False)[0]
    setup = nonlinear_setup("lateral", flight.airspeed_mps)
    result = fit("output-error-white", setup.plain, [flight.maneuver])
    truth = np.array([flight.truth[name] for name in AXES["lateral"]])
    found = np.array([result.value(name) for name in AXES["lateral"]])
    assert np.all(np.abs(found / truth - 1.0) < [0.01, 0.003, 0.03])
    assert abs(result.value("L_V")) > 3.0 * float(result.half_width()[result.index("L_V")])


def test_search_does_not_end_where_the_airspeed_is_all_noise() -> None:
    """Seed 2046 did: accelerometer exact, 0.9 m/s of noise on airspeed, D_V of the wrong sign."""
    flight = fly_nonlinear("longitudinal", 1.0, [2046], with_pilot=True)[0]
    setup = nonlinear_setup("longitudinal", flight.airspeed_mps)
    truth = np.array([flight.truth[name] for name in AXES["longitudinal"]])
    ours, half, _, _ = fit_both(setup, flight.maneuver, truth)
    assert np.all(np.abs(ours) < 0.03)
    assert half[0] < 0.012
    assert varying("longitudinal", flight.airspeed_mps).trim.airspeed_mps != 17.0
