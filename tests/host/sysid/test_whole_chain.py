"""From a virtual flight to the answer: finding, grading, correcting, converting, saying so."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.aircraft.mass_properties import AirframeData
from host.cli import main
from host.sysid.flight import read_columns
from host.sysid.maneuvers import detect_maneuvers, grade
from host.sysid.reconstruction.position_correction import transfer_to_cg


@pytest.fixture(scope="module")
def flown(simulated: Callable[[str, int], Path]) -> tuple[Path, dict[str, Any]]:
    """One simulated flight without a recorder, and its truth."""
    folder = simulated("demo", 3)
    with (folder / "flight.truth.toml").open("rb") as file:
        return folder / "flight.csv", tomllib.load(file)


def test_every_maneuver_is_found_and_nothing_else(flown: tuple[Path, dict[str, Any]]) -> None:
    columns, _ = read_columns(flown[0])
    found = detect_maneuvers(columns)
    truth = flown[1]["maneuver"]
    assert isinstance(truth, list)
    assert len(found) == len(truth)
    for ours, theirs in zip(found, truth, strict=True):
        assert ours.axis.startswith(theirs["axes"][0])
        assert ours.kind.replace("-", "") == theirs["kind"].replace("-", "")
        first, last = theirs["start_s"], theirs["end_s"]  # GPS has put the clock right
        overlap = min(ours.end_s, last) - max(ours.start_s, first)
        union = max(ours.end_s, last) - min(ours.start_s, first)
        assert overlap / union > 0.85


def test_a_bad_test_point_is_named_before_anyone_fits_it() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 20.0, 0.01)
    elevator = np.where((t > 8.0) & (t < 8.5), 0.06, 0.0) - np.where((t > 8.5) & (t < 9.0), 0.06, 0)
    elevator = elevator + 0.03 * np.sin(3.0 * t) * (t > 9.2)  # the pilot stirs afterwards
    columns = {
        "t_s": t,
        "elevator_rad": elevator + 1e-4 * rng.standard_normal(len(t)),
        "q_radps": 0.02 * rng.standard_normal(len(t)),
    }
    found = detect_maneuvers(columns)
    assert [f.kind for f in found] == ["doublet"]
    remarks = " ".join(grade(columns, found[0]).remarks)
    assert "larger input" in remarks
    assert "pilot corrects" in remarks
    quiet = {**columns, "elevator_rad": 1e-3 * rng.standard_normal(len(t))}
    assert detect_maneuvers(quiet) == []


def test_a_sweep_is_found_from_its_first_slow_swing() -> None:
    t = np.arange(0.0, 40.0, 0.01)
    inside = (t > 8.0) & (t < 33.0)
    phase = 2.0 * np.pi * (0.2 * (t - 8.0) + 0.076 * (t - 8.0) ** 2)
    columns = {"t_s": t, "elevator_rad": np.where(inside, 0.06 * np.sin(phase), 0.0)}
    found = detect_maneuvers(columns)
    assert [f.kind for f in found] == ["sweep"]
    assert found[0].start_s == pytest.approx(8.0, abs=0.6)
    assert found[0].input_end_s == pytest.approx(33.0, abs=0.3)


def test_vane_and_accelerometer_are_moved_to_the_cg() -> None:
    """A rigid body in made-up motion: sensors off the CG, corrected, give the CG again."""
    t = np.arange(0.0, 4.0, 0.001)
    p, q, r = 0.8 * np.sin(5.0 * t), 0.6 * np.cos(4.0 * t), 0.3 * np.sin(3.0 * t)
    omega = np.column_stack([p, q, r])
    arm = np.array([0.05, -0.02, 0.03])
    rate = np.gradient(omega, t, axis=0)
    extra = np.cross(rate, arm) + np.cross(omega, np.cross(omega, arm))
    cg = np.column_stack([0.1 * t, np.sin(t), -9.8 + np.cos(t)])
    sensed = cg + extra
    vane = np.array([0.2, 0.0, 0.0])
    speed = np.full(len(t), 17.0)
    columns = {
        "t_s": t, "airspeed_mps": speed, "p_radps": p, "q_radps": q, "r_radps": r,
        "ax_mps2": sensed[:, 0], "ay_mps2": sensed[:, 1], "az_mps2": sensed[:, 2],
        "alpha_rad": 1.1 * (0.1 - q * vane[0] / speed), "beta_rad": 0.05 + r * vane[0] / speed,
    }  # fmt: skip
    airframe = AirframeData(
        "made up", 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0,
        imu_m=(0.05, -0.02, 0.03), vanes_m=((0.2, 0.0, 0.0),), upwash=0.1,
    )  # fmt: skip
    back = transfer_to_cg(columns, airframe)
    inner = slice(5, -5)
    for axis, name in enumerate(("ax_mps2", "ay_mps2", "az_mps2")):
        np.testing.assert_allclose(back[name][inner], cg[inner, axis], atol=1e-6)
    np.testing.assert_allclose(back["alpha_rad"], 0.1, atol=1e-9)
    np.testing.assert_allclose(back["beta_rad"], 0.05, atol=1e-9)


def test_verbs_fail_in_one_line(
    flown: tuple[Path, dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = str(flown[0])
    for wrong in (
        ["identify", source, "--truth", source],
        ["identify", str(tmp_path / "nothing.bin")],
        ["identify", source, "--method", "magic"],
        ["identify", source, "--model", "hovercraft"],
        ["identify", source, "--from", "1", "--to", "1.01"],
        ["identify", source, "--maneuver", "99"],
    ):
        assert main(wrong) == 2
        captured = capsys.readouterr()
        assert captured.err.count("\n") == 1
        assert "Traceback" not in captured.err


def test_slow_rows_of_the_same_flight_are_graded_alike(flown: tuple[Path, dict[str, Any]]) -> None:
    """Between rows of a radio the motion itself turns: its noise was overstated fivefold."""
    columns, _ = read_columns(flown[0])
    slow = {name: column[::4] for name, column in columns.items()}  # 25 Hz
    # Gusts move the airspeed of a throttle's pulse between slow rows: that is its noise.
    at_100_hz, at_25_hz = (
        [grade(c, item).score for item in detect_maneuvers(c) if item.axis != "throttle"]
        for c in (columns, slow)
    )
    assert at_25_hz == pytest.approx(at_100_hz, abs=0.1)
    assert not any(grade(slow, item).remarks for item in detect_maneuvers(slow))
