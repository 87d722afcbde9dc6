"""What a recorded flight says at rest, against the noise each sensor is specified with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.log import FlightLog, read_log
from host.twin.flight import fly as flight
from host.twin.flight.fly import fly
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors import analog, bmp085, imu, ubx
from host.twin.sensors.analog import CHANNELS
from host.twin.sensors.local_flow import air_data
from host.twin.sensors.mega_clock import clock_share
from host.twin.sensors.sensor_delays import FILTERS
from host.twin.testcard import cards

CARD = {
    "format": 1,
    "aircraft": "ultrastick25e",
    "flight": {"ground_s": 45.0},
    "segment": [{"kind": "trim", "duration_s": 3.0}],
}
REST_US = (5e6, 43e6)
ROUNDING = 1.0 / 12.0  # variance of rounding to whole steps


def recorded(folder: Path, *, noise: bool) -> tuple[FlightLog, float]:
    card = cards.parse(CARD, "rest")
    sensors = replace(card.sensors, noise=noise, receiver_jitter=noise, pitot_drift=False)
    card = replace(card, sensors=sensors)
    record = fly(card, seed=8)
    recording = sitl.record(stimuli(record, air_data(record)), rate_hz=100, aircraft="x")
    path = folder / f"rest{noise}.bin"
    path.write_bytes(recording.log)
    return read_log(path), clock_share(record)


@pytest.fixture(scope="module")
def logs(library: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[bool, FlightLog]:
    assert library.is_file()
    folder = tmp_path_factory.mktemp("rest")
    return {noise: recorded(folder, noise=noise)[0] for noise in (True, False)}


def spread(log: FlightLog, frame: str, name: str) -> float:
    """Standard deviation of a field at rest, in its raw steps."""
    rows = log.frames[frame]
    still = (rows["t_us"] > REST_US[0]) & (rows["t_us"] < REST_US[1])
    return float(rows[name][still].astype(float).std())


def expected() -> list[tuple[str, str, float, float]]:
    """Frame, field, standard deviation in raw steps, relative tolerance (3 standard errors)."""
    found = []
    for kind, density, step, hertz in (
        ("pqr", imu.GYRO_NOISE_RADPS_RTHZ, imu.GYRO_LSB_RADPS, FILTERS[3][0][0]),
        (("ax", "ay", "az"), imu.ACCEL_NOISE_MPS2_RTHZ, imu.ACCEL_LSB_MPS2, FILTERS[3][1][0]),
    ):
        # One pole passes white noise of pi/2 times its bandwidth.
        size = density / step * (hertz * np.pi / 2.0) ** 0.5
        found += [("ident", name, (size**2 + ROUNDING) ** 0.5, 0.10) for name in kind]
    for name in ("aileron", "elevator", "rudder", "throttle", "switch"):
        # A width is the difference of two stamps of 0.5 us.
        found.append(("ident", f"rc_{name}", 2.0 * flight.JITTER_US, 0.10))
    found.append(("baro", "static_pressure", 16.0 * bmp085.NOISE_PA, 0.12))
    for name in ("v_north", "v_east", "v_down"):
        found.append(("gps", name, 100.0 * ubx.VELOCITY_NOISE_MPS, 0.18))
    found.append(("gps", "height", 1000.0 * 2.0 * ubx.POSITION_NOISE_M, 0.18))
    return found


@pytest.mark.parametrize("name", CHANNELS)
def test_noise_of_an_analogue_channel_passes_the_converter(
    logs: dict[bool, FlightLog], name: str
) -> None:
    noise = analog.NOISE_COUNT[name.split("_")[0]]
    rows = logs[True].frames["ident"]
    still = (rows["t_us"] > REST_US[0]) & (rows["t_us"] < REST_US[1])
    mean = float(rows[name][still].mean()) / 4.0
    # Less than a step of noise: what rounding makes of it depends on where between two steps the
    # voltage stands.
    drawn = mean + noise * np.random.default_rng(1).standard_normal(100_000)
    size = 2.0 * float(np.round(drawn).std())
    assert spread(logs[True], "ident", name) == pytest.approx(size, rel=0.08)
    assert spread(logs[False], "ident", name) < 0.5 * size


@pytest.mark.parametrize(("frame", "name", "size", "tolerance"), expected())
def test_noise_in_the_log_is_that_of_the_specification(
    logs: dict[bool, FlightLog], frame: str, name: str, size: float, tolerance: float
) -> None:
    assert spread(logs[True], frame, name) == pytest.approx(size, rel=tolerance)
    # Without the noise its bound does not hold.
    assert spread(logs[False], frame, name) != pytest.approx(size, rel=tolerance)


def test_the_clock_is_off_by_what_was_drawn(library: Path, tmp_path: Path) -> None:
    assert library.is_file()
    log, share = recorded(tmp_path, noise=True)
    gps = log.frames["gps"]
    rate = np.polyfit(gps["itow_ms"].astype(float), gps["t_us"] * 1e-3, 1)[0]
    assert abs(share) > 1e-4
    assert rate - 1.0 == pytest.approx(share, abs=2e-6)
    table = log.table()
    elapsed = float(table["t_s"].iloc[-1] - table["t_s"].iloc[0])
    raw = float(log.frames["ident"]["t_us"][-1] - log.frames["ident"]["t_us"][0]) * 1e-6
    assert elapsed == pytest.approx(raw / (1.0 + share), rel=1e-5)
    assert elapsed != pytest.approx(raw, rel=1e-5)
