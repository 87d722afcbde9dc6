"""Lateral maneuvers of our instrument reach the gust filter as means over 20 ms."""

import numpy as np
import pytest
from host.instrument.deviations import sensor_error_model
from host.sysid.compatibility.reconstruction import Compatibility
from host.sysid.flight.filter_step import with_filter_step
from host.sysid.flight.maneuver_detection import DetectedManeuver
from host.sysid.flight.reconstructed_flight import FlownManeuver, ReconstructedFlight
from host.sysid.models.templates import Trim, template

NAMES = (
    "airspeed_mps", "alpha_rad", "q_radps", "theta_rad", "ax_mps2", "az_mps2", "elevator_rad",
    "beta_rad", "p_radps", "r_radps", "phi_rad", "ay_mps2", "aileron_rad", "rudder_rad",
)  # fmt: skip
FOUND = DetectedManeuver("aileron_rad", "doublet", 2.0, 3.0, 6.0, 0.1, 3)


def _flown(dt_s: float, *, known: bool) -> FlownManeuver:
    t = np.arange(0.0, 10.0, dt_s)
    columns = {"t_s": t} | {name: np.sin((k + 1.0) * t) for k, name in enumerate(NAMES)}
    instrument = sensor_error_model("ultrastick25e") if known else None
    agreement = Compatibility((), {}, (), gps=False, instrument=instrument)
    flight = ReconstructedFlight("", columns, columns, (FOUND,), agreement, not known)
    return FlownManeuver(FOUND, flight, "doublet")


def test_means_are_the_same_of_inputs_and_outputs() -> None:
    model, plain = template("lateral", Trim(18.0)), _flown(0.005, known=True)
    [mean] = with_filter_step([plain], model)
    fine, coarse = plain.cut(model), mean.cut(model)
    assert coarse.dt_s == pytest.approx(0.02)
    assert coarse.samples == fine.samples // 4
    for wide, narrow in ((fine.inputs, coarse.inputs), (fine.outputs, coarse.outputs)):
        for k in range(0, coarse.samples, 50):
            np.testing.assert_allclose(narrow[k], wide[4 * k : 4 * k + 4].mean(axis=0))
    t = mean.inside()["t_s"]
    np.testing.assert_allclose(np.diff(t), 0.02)
    assert len(t) == coarse.samples


def test_slow_columns_of_others_and_longitudinal_ones_stay_as_they_are() -> None:
    lateral = template("lateral", Trim(18.0))
    for plain, model in (
        (_flown(0.02, known=True), lateral),
        (_flown(0.04, known=True), lateral),
        (_flown(0.005, known=False), lateral),
        (_flown(0.005, known=True), template("longitudinal", Trim(18.0))),
    ):
        [same] = with_filter_step([plain], model)
        np.testing.assert_array_equal(same.cut(model).outputs, plain.cut(model).outputs)
