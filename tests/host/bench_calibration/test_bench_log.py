"""Held positions found in a recording, by themselves and by marks; the IMU's faces and turns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.bench_calibration.bench_log import BenchLog
from host.bench_calibration.bench_plan import find_subject, subjects
from host.bench_calibration.bench_session import Bench, calibrate
from host.constants import GRAVITY_MPS2, RAD_PER_DEG
from host.errors import ExitCode, UsageError
from host.physical.calibration import load_calibration

from tests.host.bench_calibration.recordings import MOVE_S, RATE_HZ, held_counts, recording
from tests.host.logs import ROOT

VANES = subjects()["vanes"]
SLOPE = 1024 / 360  # counts per deg


def _bench(word: str, *sources: Path, **options: object) -> Bench:
    subject, channel = find_subject(word)
    return Bench(subject, channel, sources, into=sources[0].parent / "own.toml", **options)  # type: ignore[arg-type]


def _levels(repeats: int) -> list[float]:
    once = [505.0 + SLOPE * p for p in VANES.positions]
    return once + once[1:] * (repeats - 1)


def test_plateaus_are_found_by_themselves(tmp_path: Path) -> None:
    log = recording(tmp_path / "bench.bin", {"alpha_a": held_counts(_levels(2))})
    result = calibrate(_bench("alpha_a", log))
    (line,) = result.data["lines"]
    assert line["readings"] == 33
    assert line["zero"] == pytest.approx(505.0, abs=0.05)
    assert line["slope"] == pytest.approx(RAD_PER_DEG / SLOPE, rel=1e-3)
    assert line["hysteresis"] < 0.1
    read = load_calibration(tmp_path / "own.toml").lines["channel.alpha_a"]
    assert read.zero[0] == pytest.approx(line["zero"], rel=1e-5)
    assert not read.default


def test_a_second_recording_is_a_further_repeat(tmp_path: Path) -> None:
    paths = []
    for number in range(3):
        counts = held_counts(_levels(1), seed=number)
        paths.append(recording(tmp_path / f"{number}.bin", {"alpha_a": counts}))
    (line,) = calibrate(_bench("alpha_a", *paths)).data["lines"]
    assert len(line["repeat_zeros"]) == 3
    assert line["short"] == ""


def test_marks_say_where(tmp_path: Path) -> None:
    """Holds of half a second are too short to be seen; the marks name them."""
    levels = _levels(1)
    each_s = 0.5 + MOVE_S
    marks = [each_s * k + 0.45 for k in range(1, len(levels))]
    counts = held_counts([levels[0], *levels], hold_s=0.5)
    counts[: round(each_s * RATE_HZ)] = levels[0]
    marks = [each_s * (k + 1) + 0.48 for k in range(len(levels))]
    log = recording(tmp_path / "bench.bin", {"alpha_a": counts}, marks)
    (line,) = calibrate(_bench("alpha_a", log)).data["lines"]
    assert line["readings"] == len(levels)


def test_what_the_radio_carried_is_a_recording_too(tmp_path: Path) -> None:
    """20 rows a second; one envelope in ten lost in bursts."""
    log = recording(tmp_path / "radio.bin", {"alpha_a": held_counts(_levels(1))}, radio=True)
    data = log.read_bytes()
    pieces = [data[k : k + 1500] for k in range(0, len(data), 1500)]
    log.write_bytes(b"".join(p[:-150] for p in pieces))
    (line,) = calibrate(_bench("alpha_a", log)).data["lines"]
    assert line["readings"] == 17
    assert line["zero"] == pytest.approx(505.0, abs=0.1)


def test_a_round_that_lacks_a_position_is_told_with_its_times(tmp_path: Path) -> None:
    log = recording(tmp_path / "bench.bin", {"alpha_a": held_counts(_levels(1)[:-2])})
    with pytest.raises(UsageError, match="15 held positions found, expected 17") as caught:
        calibrate(_bench("alpha_a", log))
    assert "(505)" in str(caught.value)


def test_swapped_plugs_are_named_in_a_recording(tmp_path: Path) -> None:
    log = recording(tmp_path / "bench.bin", {"alpha_b": held_counts(_levels(1))})
    result = calibrate(_bench("alpha_a", log))
    assert result.data["lines"][0]["doubt"].startswith("alpha_a and alpha_b are swapped")
    assert result.exit_code == ExitCode.CHECK
    assert not (tmp_path / "own.toml").exists()


@pytest.mark.parametrize(("fall", "said"), [(0.0, None), (0.004, "dp_a has a leaking tube")])
def test_a_held_pressure_shows_a_leak(tmp_path: Path, fall: float, said: str | None) -> None:
    positions = subjects()["pitots"].positions
    levels = [512.0 + 2.0 * p for p in positions]
    hold = 70 * RATE_HZ
    held = 512.0 + 80.0 * np.exp(-fall * np.arange(hold) / RATE_HZ)
    rise = np.linspace(held[-1], levels[0], RATE_HZ)
    log = recording(tmp_path / "bench.bin", {"dp_a": np.r_[held, rise, held_counts(levels)]})
    (line,) = calibrate(_bench("dp_a", log)).data["lines"]
    assert (line["doubt"] or "")[:23] == (said or "")
    assert line["readings"] == len(positions)


def test_servo_pulses_come_from_the_receiver(tmp_path: Path) -> None:
    positions = subjects()["servos"].positions
    levels = [1500.0 + 10.0 * p for p in positions]
    log = recording(tmp_path / "bench.bin", {"rc_elevator": held_counts(levels)})
    (line,) = calibrate(_bench("elevator", log)).data["lines"]
    assert line["zero"] == pytest.approx(1500.0, abs=0.2)
    assert line["slope"] == pytest.approx(RAD_PER_DEG / 10.0, rel=1e-3)


def test_six_faces_in_any_order(tmp_path: Path) -> None:
    zero, slope = np.array([0.12, -0.05, 0.31]), np.array([1.004, 0.998, 1.011])
    faces = [(2, -1), (0, 1), (2, 1), (1, -1), (0, -1), (1, 1)] * 2
    forces = np.zeros((len(faces), 3))
    for k, (axis, sign) in enumerate(faces):
        forces[k, axis] = sign * GRAVITY_MPS2
    raw = zero + forces / slope
    channels = {
        name: held_counts(raw[:, k].tolist(), 4.0, noise=0.03, seed=k)
        for k, name in enumerate(("ax", "ay", "az"))
    }
    log = recording(tmp_path / "bench.bin", channels)
    result = calibrate(_bench("accelerometers", log))
    read = load_calibration(tmp_path / "own.toml").lines["imu.accel"]
    assert read.zero == pytest.approx(zero.tolist(), abs=0.01)
    assert read.slope == pytest.approx(slope.tolist(), abs=1e-3)
    assert result.exit_code == ExitCode.OK


def test_gyros_are_turned_by_a_known_angle(tmp_path: Path) -> None:
    zero, slope = np.array([0.004, -0.003, 0.002]), np.array([1.01, 0.99, 1.02])
    rest, turn = 8 * RATE_HZ, 20 * RATE_HZ
    shape = 1.0 - np.cos(2.0 * np.pi * np.arange(turn) / turn)  # mean 1
    parts = [np.zeros((rest, 3))]
    for axis in range(3):
        for sign in (1.0, -1.0):
            moved = np.zeros((turn, 3))
            moved[:, axis] = sign * 3600.0 * RAD_PER_DEG * shape * RATE_HZ / turn
            parts += [moved, np.zeros((rest, 3))]
    raw = zero + np.concatenate(parts) / slope
    raw += 1e-3 * np.random.default_rng(3).standard_normal(raw.shape)
    channels = dict(zip(("p", "q", "r"), raw.T, strict=True))
    log = recording(tmp_path / "bench.bin", channels)
    calibrate(_bench("gyros", log))
    read = load_calibration(tmp_path / "own.toml").lines["imu.gyro"]
    assert read.zero == pytest.approx(zero.tolist(), abs=2e-4)
    assert read.slope == pytest.approx(slope.tolist(), rel=2e-3)


def test_a_clock_that_starts_anew_never_goes_back() -> None:
    """A log of two sessions: the second one's clock began at its reset."""
    bench = BenchLog.read(ROOT / "tests/data/format-1-sitl-causes.bin")
    assert (np.diff(bench.t_s) > 0.0).all()
    assert bench.t_s[-1] < 100.0


def test_a_folder_or_a_missing_file_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file"):
        calibrate(_bench("alpha_a", tmp_path / "none.bin"))
