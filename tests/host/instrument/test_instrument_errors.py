"""One standard deviation of each named error: who says it, and that it reaches every reader."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import load
from host.aircraft.mass_properties import airframe_data
from host.constants import EVEN_SD
from host.errors import CalibrationError
from host.instrument.deviations import deviations, sensor_error_model
from host.instrument.instrument_errors import (
    instrument_errors,
    standard_errors,
)
from host.physical.calibration import load_calibration
from host.physical.recording import Recording
from host.resources import resource
from host.sysid.flight import FlightColumns
from host.sysid.pipeline import aircraft_data
from host.sysid.reconstruction import prior
from host.twin.flight.draws import DRAWN_ERRORS, draw
from host.twin.outcome.virtual_calibration import calibration

NAME = "ultrastick25e"


def measured(tmp_path: Path, more: str = "") -> Path:
    """Write the default calibration as a measured one, with more behind it."""
    text = resource("default.toml").read_text(encoding="utf-8").replace("default = true", "")
    path = tmp_path / "mine.toml"
    path.write_text(text + more, encoding="utf-8")
    return path


def test_every_error_says_how_it_is_drawn_for_whom_and_by_whose_word() -> None:
    for error in standard_errors():
        assert error.distribution in ("even", "normal"), error.name
        assert error.drawn in ("instrument", "flight"), error.name
        assert len(error.width) == len(error.sensors) > 0, error.name
        assert set(error.shared) <= set(error.sensors), error.name
        assert error.source, error.name
        # No error at all where an aircraft file tells it: no_file.toml has what it is without one.
        told = {"vane_flow_share", "vane_ahead_m"}
        assert min(error.sigmas) > 0.0 or error.name in told, error.name


def test_lines_of_a_calibration_reach_identification(tmp_path: Path) -> None:
    """Each zero_sigma and slope_sigma of what identification reads is a deviation of its own."""
    data = sensor_error_model(NAME, load_calibration(measured(tmp_path)))
    found = deviations(data, airframe_data(NAME))
    # The default's lines, had somebody measured them: two sensors each, whose mean is read.
    slope = 2.0 * math.pi / 1024.0
    assert found["alpha_zero_rad"] == pytest.approx(6.0 * slope / math.sqrt(2.0))
    assert found["beta_scale"] == pytest.approx(0.01 / math.sqrt(2.0))
    assert found["pitot_zero_pa"] == pytest.approx(51.2 * 4.8828125 / math.sqrt(2.0))
    assert found["pitot_scale"] == pytest.approx(0.025 / math.sqrt(2.0))
    assert found["elevator_scale"] == pytest.approx(0.05)
    assert found["aileron_scale"] == pytest.approx(0.05 / math.sqrt(2.0))
    assert found["gyro_x_bias_radps"] == pytest.approx(0.349)
    assert found["accel_z_scale"] == pytest.approx(0.03)
    before = prior(data)
    assert before["gyro_x_bias_radps"][1] == pytest.approx(0.349)
    assert before["beta_zero_rad"][1] == pytest.approx(6.0 * slope / math.sqrt(2.0))


def test_a_line_nobody_measured_and_a_missing_key_take_named_defaults(tmp_path: Path) -> None:
    standard = deviations(sensor_error_model(NAME), airframe_data(NAME))
    assert deviations(sensor_error_model(NAME, load_calibration()), airframe_data(NAME)) == standard
    path = tmp_path / "one.toml"
    text = resource("default.toml").read_text(encoding="utf-8")
    head = 'format = "flight-test-calibration"\nversion = 1\nname = "one"\ndate = "2026-11-22"\n'
    line = text[text.index("[channel.alpha_a]") : text.index("[channel.alpha_b]")]
    path.write_text(head + line, encoding="utf-8")
    one = deviations(sensor_error_model(NAME, load_calibration(path)), airframe_data(NAME))
    assert {n for n in one if one[n] != standard[n]} == {"alpha_zero_rad", "alpha_scale"}


def test_a_log_made_with_default_lines_has_sensors_out_of_the_box(tmp_path: Path) -> None:
    """Lines that nobody measured count where they made the columns; a table [error] goes first."""
    known, default = aircraft_data(NAME), load_calibration()
    table = FlightColumns({}, [], Recording(), None)
    assert known.flown(table) == known.instrument
    found = deviations(known.flown(replace(table, calibration=default)), airframe_data(NAME))
    # hw/calibration/default.toml: a vane mounted by eye, a pitot untared
    assert found["alpha_zero_rad"] == pytest.approx(np.deg2rad(2.1) / math.sqrt(2.0), rel=0.01)
    assert found["pitot_zero_pa"] == pytest.approx(250.0 / math.sqrt(2.0))
    assert found["elevator_scale"] == pytest.approx(0.05)
    path = measured(tmp_path)
    own = load_calibration(path)
    assert not own.defaults()
    calibrated = aircraft_data(NAME, path)
    assert calibrated.flown(replace(table, calibration=own)) == calibrated.instrument
    text = resource("default.toml").read_text(encoding="utf-8")
    path.write_text(
        f"{text}[error.vane_zero_rad]\nsigma = 0.001\nsource = 'a template'\n", encoding="utf-8"
    )
    half = aircraft_data(NAME, path).flown(replace(table, calibration=load_calibration(path)))
    assert half.errors["vane_zero_rad"].sigma("alpha_a") == pytest.approx(0.001)
    assert half.errors["pot_scale"].sigma("pot_rudder") == pytest.approx(0.05)


def test_an_error_table_says_size_law_constancy_and_who_shares_it(tmp_path: Path) -> None:
    more = """
[error.thrust_share]
sigma = 0.05
source = "static thrust, spring scale"
[error.vane_scale]
shared = ["alpha_a", "alpha_b"]
drawn = "flight"
distribution = "normal"
source = "one wind tunnel for both"
[error.delay_share]
half_width = [0.1, 0.2, 0.3, 0.1, 0.1, 0.1, 0.1, 0.1]
source = "flash lamp and oscilloscope"
"""
    plane = load(NAME)
    errors = instrument_errors(plane, load_calibration(measured(tmp_path, more)))
    assert errors["thrust_share"].sigma("propeller") == 0.05
    scale = errors["vane_scale"]
    assert (scale.distribution, scale.drawn) == ("normal", "flight")
    assert scale.of_mean("alpha_a", "alpha_b") == pytest.approx(0.01)  # of one value, not of two
    assert scale.of_mean("beta_a", "beta_b") == pytest.approx(0.01 / math.sqrt(2.0))
    late = errors["delay_share"]
    assert late.sigma("alpha_b") == pytest.approx(0.3 * EVEN_SD)
    draws = [
        draw(plane, np.random.default_rng(k), tolerances=True, errors=errors) for k in range(300)
    ]
    drawn = np.array([d.vector("vane_scale_share") for d in draws])
    assert np.array_equal(drawn[:, 0], drawn[:, 1])
    assert np.all(drawn[:, 2] != drawn[:, 3])
    assert np.std(drawn[:, 0]) == pytest.approx(0.01, rel=0.2)
    # Beyond an even distribution of the same deviation.
    assert np.abs(drawn[:, 0]).max() > 0.01 / EVEN_SD


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[error.luck]\nsigma = 1.0", r"\[error.luck\] is unknown; known are gyro_bias_radps"),
        ("[error.cg_m]\nsigma = 1.0", "belongs into the aircraft file, as mass.cg_tolerance_m"),
        ("[error.thrust_share]\nsigma = -1.0", "sigma is -1.0, expected a number of 0 or more"),
        ("[error.thrust_share]\nsigma = nan", "sigma is nan, expected a number"),
        ("[error.thrust_share]\nsigma = [0.1, 0.1]", "expected a number of 0 or more, or 1 of"),
        ("[error.thrust_share]\nwidth = 1.0", "has 'width', expected of sigma"),
        ("[error.thrust_share]\nhalf_width = 1.0", "is normal and has half_width"),
        ("[error.pot_scale]\nshared = ['alpha_a']", "shared is .* expected of .'pot_elevator'"),
        ("[error.pot_scale]\ndistribution = 'flat'", "'flat', expected even or normal"),
        ("[error.pot_scale]\ndrawn = 'daily'", "'daily', expected instrument or flight"),
    ],
)
def test_a_wrong_error_table_is_one_line(tmp_path: Path, table: str, words: str) -> None:
    path = measured(tmp_path, f"{table}\nsource = 'a test'\n")
    with pytest.raises(CalibrationError, match=words) as caught:
        instrument_errors(load(NAME), load_calibration(path))
    assert "\n" not in str(caught.value)


def test_an_error_without_a_source_or_a_table_is_one_line(tmp_path: Path) -> None:
    path = measured(tmp_path, "[error.thrust_share]\nsigma = 0.1\n")
    with pytest.raises(CalibrationError, match=r"\[error.thrust_share\] has no source"):
        instrument_errors(None, load_calibration(path))
    path.write_text("error = 3\n" + path.read_text().partition("[error")[0], encoding="utf-8")
    with pytest.raises(CalibrationError, match=r"expected tables \[error.NAME\]"):
        load_calibration(path)


def test_the_twin_draws_what_the_file_says_and_writes_what_it_drew_from(tmp_path: Path) -> None:
    plane = load(NAME)
    wide = instrument_errors(plane).scaled(3.0)
    once = draw(plane, np.random.default_rng(1), tolerances=True)
    thrice = draw(plane, np.random.default_rng(1), tolerances=True, errors=wide)
    for name, *_ in DRAWN_ERRORS:
        assert thrice.vector(name) == pytest.approx(3.0 * once.vector(name)), name
    path = tmp_path / "written.toml"
    path.write_text(calibration(plane, wide), encoding="utf-8")
    read = instrument_errors(plane, load_calibration(path))
    for error in wide:
        if not error.aircraft_file:
            assert read[error.name].sigmas == pytest.approx(error.sigmas, rel=1e-3), error.name


def test_what_is_constant_of_an_instrument_stays_from_flight_to_flight() -> None:
    plane, errors = load(NAME), standard_errors()
    first, second = (
        draw(
            plane,
            np.random.default_rng(flight),
            tolerances=True,
            of_instrument=np.random.default_rng(7),
        )
        for flight in (1, 2)
    )
    for name, of, *_ in DRAWN_ERRORS:
        same = np.array_equal(first.vector(name), second.vector(name))
        assert same == (errors[of].drawn == "instrument"), name
