"""Departures from the linear model: coefficients hold while airspeed and attitude vary."""

from dataclasses import replace

import numpy as np
import pytest
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.sysid import Maneuver, fit
from host.sysid.aerodynamics.varying_airspeed import VaryingModel
from host.sysid.models import Trim, template
from host.sysid.models.reduced_model import without_outputs
from studies.gusts import AXES, DT_S, gusty_aircraft
from studies.nonlinear_gusts import NonlinearFlight, fly_nonlinear, varying
from studies.turbulence import fit_both, nonlinear_setup


@pytest.fixture(scope="module", params=list(AXES))
def calm(request: pytest.FixtureRequest) -> tuple[str, NonlinearFlight]:
    axis = str(request.param)
    return axis, fly_nonlinear(axis, 0.0, [3], with_pilot=False)[0]


def test_coefficients_of_a_flight_that_changes_speed_come_back(
    calm: tuple[str, NonlinearFlight],
) -> None:
    axis, flight = calm
    plane = gusty_aircraft()
    base = plane.models[axis]
    truth = np.array([flight.truth[name] for name in AXES[axis]])
    plain = Maneuver(
        DT_S,
        np.column_stack([flight.columns[c] for c in base.inputs]),
        np.column_stack([flight.columns[c] for c in base.outputs]),
    )
    assert np.ptp(flight.columns["airspeed_mps"]) > 1.0
    errors = []
    for model, maneuver in (
        (base, plain),
        (varying(axis, flight.airspeed_mps).model, flight.maneuver),
    ):
        result = fit("output-error-white", model, [maneuver])
        found = np.array([result.value(name) for name in AXES[axis]])
        errors.append(np.abs(found / truth - 1.0))
    assert np.all(errors[1] < 0.08)
    assert np.max(errors[0]) > 3.0 * np.max(errors[1])


def test_a_short_period_without_a_vane_is_explained_while_airspeed_varies() -> None:
    """As of an autopilot's log: az has the lift that airspeed makes, and no state says so."""
    flight = fly_nonlinear("longitudinal", 0.0, [3], with_pilot=False)[0]
    c = flight.columns
    trim = Trim(flight.airspeed_mps, float(c["alpha_rad"].mean()), float(c["theta_rad"].mean()))
    base = without_outputs(template("short-period", trim), ("alpha_rad",))
    base = replace(base, output_biases=("q_radps",))
    wide = VaryingModel(base, "short-period", trim, None)
    varying = wide.maneuver(c, DT_S)
    plain = replace(varying, inputs=varying.inputs[:, :1])
    left = []
    for model, maneuver in ((base, plain), (wide.model, varying)):
        residuals = fit("output-error-white", model, [maneuver]).residuals[0]
        left.append(np.std(residuals, axis=0) / np.std(maneuver.outputs, axis=0))
    assert np.all(left[1] < np.array([0.6, 0.2]) * left[0])  # q, az


def test_departures_vanish_at_the_trim() -> None:
    plane = varying("lateral")
    samples = 50
    columns = {name: np.zeros(samples) for name in ("aileron_rad", "rudder_rad")}
    columns |= {
        name: np.zeros(samples)
        for name in (
            "beta_rad", "p_radps", "q_radps", "r_radps", "phi_rad", "ax_mps2", "ay_mps2", "az_mps2",
        )
    }  # fmt: skip
    columns["az_mps2"] = np.full(samples, -GRAVITY_MPS2)
    columns["airspeed_mps"] = np.full(samples, plane.trim.airspeed_mps)
    columns["alpha_rad"] = np.full(samples, plane.trim.alpha_rad)
    columns["theta_rad"] = np.full(samples, plane.trim.theta_rad)
    maneuver = plane.maneuver(columns, DT_S)
    assert maneuver.inputs.shape == (samples, len(plane.model.inputs))
    np.testing.assert_allclose(maneuver.inputs, 0.0, atol=1e-12)


def test_missing_signals_and_axes_are_named(calm: tuple[str, NonlinearFlight]) -> None:
    axis, flight = calm
    columns = {k: v for k, v in flight.columns.items() if k != "theta_rad"}
    with pytest.raises(IdentificationError, match="departures need theta_rad"):
        varying(axis).maneuver(columns, DT_S)
    plane = varying(axis)
    with pytest.raises(IdentificationError, match="'phugoid', known are those of longitudinal"):
        VaryingModel(plane.base, "phugoid", plane.trim, plane.airframe)


def test_filter_error_beats_output_error_on_the_aircraft_as_it_is() -> None:
    flight = fly_nonlinear("longitudinal", 0.5, [0], with_pilot=True)[0]
    truth = np.array([flight.truth[name] for name in AXES["longitudinal"]])
    ours, half, plain, _ = fit_both(
        nonlinear_setup("longitudinal", flight.airspeed_mps), flight.maneuver, truth
    )
    assert np.all(np.abs(ours) < 0.04)
    assert np.all(half < 0.03)
    assert np.max(np.abs(plain)) > np.max(np.abs(ours))
