"""Calibration files: complete, sourced, replaceable, refused when wrong."""

from pathlib import Path

import numpy as np
import pytest
from host.errors import CalibrationError
from host.log.calibration_note import calibration_note
from host.physical.calibration import load_calibration
from host.physical.columns import ANALOGUE, INERTIAL

from tests.host.logs import ROOT, flight, read, written

HEAD = 'format = "flight-test-calibration"\nversion = 1\nname = "bench 7"\ndate = "2026-11-01"\n'
ALPHA = """
[channel.alpha_a]
unit = "rad"
zero = 500.0
slope = 5.0e-3
zero_sigma = 0.5
slope_sigma = 0.002
source = "protractor jig"
"""


def test_default_has_source_and_uncertainty_of_every_number() -> None:
    calibration = load_calibration()
    needed = {line for _, line in ANALOGUE.values()}
    needed |= {f"imu.{kind}" for _, kind, _ in INERTIAL.values()}
    needed |= {f"pulse.{name}" for name in ("elevator", "aileron", "rudder", "throttle")}
    assert needed <= set(calibration.lines)
    for name, line in calibration.lines.items():
        assert line.default, name
        assert len(line.source) > 10, name
        assert line.zero_sigma > 0.0, name
        assert 0.0 < line.slope_sigma < 0.5, name


def test_thesis_maps_where_they_are_right() -> None:
    lines = load_calibration().lines
    pulse_us = 1600.0
    mapped = (pulse_us - 1152) * 1000 / (1904 - 1152) + 1000
    elevator = lines["pulse.elevator"]
    found = (pulse_us - elevator.zero[0]) * elevator.slope[0]
    assert found == pytest.approx(np.deg2rad(0.0756 * mapped - 108.72), abs=1e-5)
    mapped = (pulse_us - 1100) * 1000 / (1956 - 1100) + 1000
    aileron = lines["pulse.aileron"]
    found = (pulse_us - aileron.zero[0]) * aileron.slope[0]
    assert found == pytest.approx(np.deg2rad(0.0738 * mapped - 112.29), abs=1e-4)


def test_own_numbers_replace_the_default_and_the_rest_is_named(tmp_path: Path) -> None:
    file = tmp_path / "bench7.toml"
    file.write_text(HEAD + ALPHA)
    log = read(tmp_path, written(*flight(1.0)), calibration=file)
    table = log.table(aligned=False)
    counts = log.frames["ident"]["alpha_a"] * 0.25
    np.testing.assert_allclose(table["alpha_a_rad"], (counts - 500.0) * 5.0e-3, atol=1e-12)
    note = calibration_note(log)
    assert note["name"] == "bench 7"
    assert "alpha_a_rad" not in note["default_columns"]
    assert {"alpha_b_rad", "alpha_rad", "q_radps"} <= set(note["default_columns"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("format = 1", "expected 'flight-test-calibration'"),
        ("format = [", "not TOML"),
        (HEAD + ALPHA.replace("alpha_a", "alpha_x"), "unknown entry [channel.alpha_x]"),
        (HEAD + ALPHA.replace('source = "protractor jig"', ""), "lacks source"),
        (HEAD + ALPHA.replace("5.0e-3", "0.0"), "no slope of 0"),
        (HEAD + ALPHA.replace("5.0e-3", '"x"'), "slope is 'x', expected a number"),
        (HEAD + ALPHA.replace("5.0e-3", "[1.0, 2.0]"), "as many zeros as slopes"),
        (HEAD + "[channel]\nalpha_a = 3\n", "expected a table"),
        (HEAD + ALPHA + "curve = [1.0]\n", "expected two numbers with one zero"),
        (HEAD + ALPHA + "curve = [1.0, 1e3]\n", "expected -100 to 100"),
    ],
)
def test_wrong_files_are_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    with pytest.raises(CalibrationError) as caught:
        load_calibration(file)
    assert said in str(caught.value)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_curve_bends_what_is_decoded(tmp_path: Path) -> None:
    log = read(tmp_path, written(*flight(1.0)))
    straight = log.table(aligned=False)
    path = tmp_path / "own.toml"
    text = (ROOT / "hw/calibration/default.toml").read_text().replace("default = true", "")
    for name in ("[channel.alpha_a]", "[pulse.throttle]"):
        text = text.replace(f"{name}\n", f"{name}\ncurve = [0.2, -0.3]\n")
    path.write_text(text)
    data = (tmp_path / "flight.bin").read_bytes()
    bent = read(tmp_path, data, calibration=path).table(aligned=False)
    for column in ("alpha_a_rad", "throttle"):
        v = straight[column].to_numpy()
        assert bent[column].to_numpy() == pytest.approx(v + 0.2 * v**2 - 0.3 * v**3)
    assert np.abs(bent["alpha_a_rad"] - straight["alpha_a_rad"]).max() > 1e-3


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match=r"nowhere\.toml: no such file"):
        load_calibration(tmp_path / "nowhere.toml")
