"""Who knows less is never surer: errors without a file are no smaller than with one."""

import math
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import load_measured
from host.instrument.deviations import unknown_sensors
from host.instrument.instrument_errors import (
    errors_without_file,
    instrument_errors,
    standard_errors,
    usual_errors,
)
from host.physical.calibration import load_calibration
from host.physical.recording import AUTOPILOT, FOREIGN, OWN, Recording
from host.sysid.flight import reconstruct_flight
from host.sysid.linear import Answer
from host.sysid.reconstruction import Compatibility, SensorErrorEstimate, prior
from studies.clean_records import AIRCRAFT, LINEAR, NAMES, flown
from studies.wrong_flights import fly

import host
from tests.host.sysid.at_hand import identify
from tests.host.sysid.conftest import known_sensors


@pytest.mark.parametrize("maker", [OWN, AUTOPILOT, FOREIGN])
def test_no_error_is_smaller_without_a_file(maker: str) -> None:
    known = instrument_errors(load_measured("ultrastick25e"), maker=maker)
    unknown = errors_without_file(maker)
    for error in known:
        # Zero and slope of vanes and pots are a data sheet's or a calibration's, whichever made
        # the columns; a tolerance is the file's.
        if error.name in {"vane_scale", "pitot_scale"} and maker == OWN:
            continue
        for sensor in error.sensors:
            assert unknown[error.name].sigma(sensor) >= 0.99 * error.sigma(sensor), error.name


def test_own_sensors_without_a_calibration_are_out_of_the_box() -> None:
    found, known = errors_without_file(OWN), load_calibration()
    by_line = known.lines["channel.pot_rudder"].slope_sigma
    assert found["pot_scale"].sigma("pot_rudder") == pytest.approx(by_line)
    assert found["place_m"].sigma("imu") > 4.0 * standard_errors()["place_m"].sigma("imu")
    assert usual_errors(OWN)["vane_flow_share"].sigma("alpha") == 0.0  # an aircraft file tells it
    assert found["vane_flow_share"].sigma("alpha") > 0.05


@pytest.mark.parametrize("maker", [OWN, FOREIGN])
def test_errors_to_one_side_are_expected_in_the_middle_of_their_range(maker: str) -> None:
    """Upwash and a boom's length are never below none; about none N_r was a third too small."""
    found = errors_without_file(maker)
    for name in ("vane_flow_share", "vane_ahead_m"):
        [half] = set(found[name].width)
        assert found[name].mean == half > 0.0
        as_they_are = found.about_none()[name]
        assert as_they_are.mean == 0.0
        assert as_they_are.sigmas[0] == pytest.approx(half * math.sqrt(4.0 / 3.0))
    assert all(e.mean == 0.0 for e in usual_errors(maker))


def test_what_is_expected_of_vanes_is_taken_out_of_the_columns() -> None:
    errors = errors_without_file(FOREIGN)
    flow, ahead_m = errors["vane_flow_share"].mean, errors["vane_ahead_m"].mean
    t, speed = np.arange(200) / 100.0, 17.0
    alpha, beta = 0.05 + 0.04 * np.sin(5.0 * t), 0.03 * np.cos(4.0 * t)
    q, r = 0.3 * np.cos(6.0 * t), 0.2 * np.sin(3.0 * t)
    columns = {
        "t_s": t,
        "airspeed_mps": np.full(len(t), speed),
        "alpha_rad": (1.0 + flow) * (alpha - q * ahead_m / speed),
        "beta_rad": (1.0 + flow) * (beta + r * ahead_m / speed),
        "q_radps": q,
        "r_radps": r,
    }
    nobody = unknown_sensors(Recording(maker=FOREIGN))
    open_ones = tuple(
        SensorErrorEstimate(name, mean, sd, sd, data_informed=False, reason="")
        for name, (mean, sd) in prior(nobody).items()
    )
    told_by_nothing = Compatibility(open_ones, {}, (), gps=False, instrument=nobody)
    flight = reconstruct_flight(columns, (), by_default=told_by_nothing)
    for name, true in (("alpha_rad", alpha), ("beta_rad", beta)):
        assert np.max(np.abs(flight.corrected[name] - true)) < 1e-9, name
    assert flight.recorded["alpha_rad"] is columns["alpha_rad"]
    assert told_by_nothing["beta_scale"].value == flow  # paths are sought about the same
    assert told_by_nothing["vane_x_m"].value == ahead_m


@pytest.mark.parametrize(("zero_rad", "least", "most"), [(0.0, 0.0, 0.1), (0.005, 0.3, 50.0)])
def test_a_record_tells_the_zero_of_a_vane_where_its_model_has_none(
    tmp_path: Path, zero_rad: float, least: float, most: float
) -> None:
    """Without any error M_q was known to twice its value; with one it is not to be relied on."""
    true = dict(zip(NAMES, AIRCRAFT[1], strict=True))
    table = flown("smooth", AIRCRAFT[1], 0.01, np.random.default_rng(19546))
    table["alpha_rad"] += zero_rad
    own = tmp_path / "mine.toml"
    start = "".join(f"{name} = {0.75 * value}\n" for name, value in true.items())
    own.write_text(f"{LINEAR}[parameters]\n{start}", encoding="utf-8")
    result = host.identify(table, models=own, from_s=0.0).linear[0].result
    half = dict(zip(result.names, result.half_width(), strict=True))
    assert all(abs(result.value(name) - value) <= half[name] for name, value in true.items())
    assert least < half["M_q"] / abs(true["M_q"]) < most


@pytest.fixture(scope="module")
def answers() -> tuple[Answer, Answer]:
    """The same record of perfect sensors, known to be such, and of sensors nobody knows."""
    flight = fly("short-period", "none", "white", 1)
    told, unknown = (
        identify(
            flight.columns, names=("short-period",), method="output-error-white",
            windows=flight.windows, user_model=flight.model, errors=errors,
        )[0]
        for errors in (known_sensors(OWN), errors_without_file(OWN))
    )  # fmt: skip
    return told, unknown


def test_the_list_of_errors_is_never_empty(answers: tuple[Answer, Answer]) -> None:
    _, unknown = answers
    assert {"alpha_scale", "elevator_scale", "vane_x_m"} <= {e.name for e in unknown.errors}
    assert all(e.origin for e in unknown.errors)


def test_no_half_width_shrinks_where_nothing_is_known(answers: tuple[Answer, Answer]) -> None:
    told, unknown = (dict(zip(a.result.names, a.result.half_width(), strict=True)) for a in answers)
    for name in ("Z_alpha", "M_alpha", "M_q", "M_de"):
        assert unknown[name] > 0.97 * told[name]
    assert unknown["M_alpha"] > 1.15 * told["M_alpha"]  # upwash is known to 6 %
