"""When each channel of a recorded flight was measured, against what its sensor is said to do.

The decoded table has the nominal delays of the schema removed. What is left of every channel is
compared with the truth behind the stated physics (poles, vane, drawn delays) as a frequency
response, computed here on its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.constants import GRAVITY_MPS2
from host.log import FlightLog, read_log
from host.physical.channels import constant_delay_us
from host.twin.flight.draws import delay_s
from host.twin.flight.fly import STEP_S, FlightRecord, fly
from host.twin.outcome import compare, virtual_calibration
from host.twin.outcome.truth_files import summary
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.filters import first_order, vane
from host.twin.sensors.imu import complementary, turned_to
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.sensors.mega_clock import clock_share
from host.twin.sensors.sensor_delays import FILTERS, GPS_LATENCY_S
from host.twin.sensors.ubx import FIRST_ITOW_MS
from host.twin.testcard import cards
from numpy.typing import NDArray

Array = NDArray[np.float64]
Response = NDArray[np.complexfloating[Any, Any]]

CARD = {
    "format": 1,
    "aircraft": "ultrastick25e",
    "pilot": {"remnant": 0.0, "early": 0.0, "timing_s": 0.0, "amplitude": 0.0},
    # What is not a matter of time is switched off; the delays stay drawn.
    "sensors": {"noise": False, "vane_friction": False, "position": False, "pitot_drift": False},
    "segment": [
        {"kind": "multisine", "axis": ["elevator", "aileron", "rudder"],
         "amplitude": [4.0, 4.0, 9.0], "low_hz": 0.4, "high_hz": 3.0, "duration_s": 40.0},
    ],
}  # fmt: skip
PRESSURE_HZ, PRESSURE_PA = 0.5, 600.0
DENSITY_HZ, DENSITY_SHARE = 1.3, 0.8
LIMIT_S = 1e-4


class Flown:
    """One recorded flight, its decoded rows on true time, and the truth."""

    def __init__(self, library: Path, folder: Path) -> None:
        assert library.is_file()
        self.record = fly(cards.parse(CARD, "delays"), seed=3)
        true = air_data(self.record)
        # Pressures of a flight change too slowly to date them to 0.1 ms: a static pressure and a
        # density that swing, for the barometer and the pitots alone.
        wave = PRESSURE_PA * np.sin(2.0 * np.pi * PRESSURE_HZ * self.record.t_s)
        swing = 1.0 + DENSITY_SHARE * np.sin(2.0 * np.pi * DENSITY_HZ * self.record.t_s)
        self.data: AirData = replace(
            true,
            static_pa=true.static_pa + wave,
            density_kgpm3=true.density_kgpm3 * swing,
            qbar_pa=true.qbar_pa * swing,
        )
        given = stimuli(self.record, self.data)
        recording = sitl.record(given, rate_hz=100, aircraft="x")
        (folder / "flight.bin").write_bytes(recording.log)
        calibration = virtual_calibration.calibration(self.record.aircraft)
        (folder / "calibration.toml").write_text(calibration)
        self.log: FlightLog = read_log(
            folder / "flight.bin", calibration=folder / "calibration.toml"
        )
        self.table: pd.DataFrame = self.log.table()
        first_us = int(self.log.frames["ident"]["t_us"][0])
        self.at_s: Array = compare.true_times(self.record, self.table, first_us).to_numpy()


@pytest.fixture(scope="module")
def flown(library: Path, tmp_path_factory: pytest.TempPathFactory) -> Flown:
    return Flown(library, tmp_path_factory.mktemp("delays"))


def behind(record: FlightRecord, signals: Array, response: Callable[[Array], Response]) -> Array:
    """Return signals (n, k) of the flight behind a response of angular frequency."""
    start = round(record.card.flight.ground_s / STEP_S)
    flying = signals[start:]
    t = np.arange(len(flying))[:, None] / (len(flying) - 1)
    straight = flying[0] + (flying[-1] - flying[0]) * t  # its ends meet: no jump where it wraps
    slope = (flying[-1] - flying[0]) / ((len(flying) - 1) * STEP_S)
    w = np.asarray(2.0 * np.pi * np.fft.rfftfreq(len(flying), STEP_S), dtype=np.float64)
    spectrum = np.fft.rfft(flying - straight, axis=0) * response(w)[:, None]
    # A straight line comes out late by the delay at rest.
    small = np.array([1e-3])
    late = -np.angle(response(small))[0] / small[0]
    out = signals.copy()
    out[start:] = np.fft.irfft(spectrum, n=len(flying), axis=0) + straight - slope * late
    return out


def left_over_s(t_s: Array, expected: Array, at_s: Array, measured: Array, column: int) -> float:
    """Return by how much `measured` is later than `expected` (n, k)[:, column].

    Scale, zero, drift and the other columns' share of it (misalignment) are fitted too.
    """
    inside = (at_s > 8.0) & (at_s < t_s[-1] - 2.5) & np.isfinite(measured)
    at = at_s[inside]
    late = 0.0
    for _ in range(4):
        rows = [np.interp(at - late, t_s, expected[:, k]) for k in range(expected.shape[1])]
        slope = np.interp(at - late, t_s, np.gradient(expected[:, column], t_s))
        left = np.column_stack([*rows, np.ones_like(at), at, -slope])
        found = np.linalg.lstsq(left, measured[inside], rcond=None)[0]
        late += found[-1] / found[column]
    return float(late)


def imu_response(record: FlightRecord, kind: int) -> Callable[[Array], Response]:
    """Return one pole at the bandwidth and a pure delay for the rest, its nominal delay removed."""
    bandwidth_hz, nominal_s = FILTERS[3][kind]
    draws = record.draws
    late = delay_s(nominal_s, draws.scalar("imu_delay_share"), draws.scalar("imu_delay_s"))
    tau = min(1.0 / (2.0 * np.pi * bandwidth_hz), late)
    rest = late - tau - nominal_s

    def response(w: Array) -> Response:
        return np.asarray(np.exp(-1j * w * rest) / (1.0 + 1j * w * tau))

    return response


def vane_response(record: FlightRecord, airspeed_mps: float, k: int) -> Callable[[Array], Response]:
    """Return the second order of a vane at one airspeed, slowed to its drawn delay."""
    plane, draws = record.aircraft, record.draws
    per_mps, zeta = (
        plane.scalar(f"sensors.{name}") for name in ("vane_frequency_hz_per_mps", "vane_damping")
    )
    nominal = 2.0 * zeta / (2.0 * np.pi * per_mps * plane.scalar("trim.airspeed_mps"))
    late = delay_s(
        nominal,
        float(draws.vector("vane_delay_share")[k]),
        float(draws.vector("vane_delay_s")[k]),
    )
    own = 2.0 * np.pi * per_mps * nominal / late * airspeed_mps
    return lambda w: np.asarray(own**2 / (own**2 - w * w + 2j * zeta * own * w))


def pitot_response(record: FlightRecord, k: int) -> Callable[[Array], Response]:
    """Return the tube's pole with its drawn delay."""
    draws = record.draws
    late = delay_s(
        record.aircraft.scalar("sensors.pitot_lag_s"),
        float(draws.vector("pitot_delay_share")[k]),
        float(draws.vector("pitot_delay_s")[k]),
    )
    return lambda w: np.asarray(1.0 / (1.0 + 1j * w * late))


def expected_of(flown: Flown, column: str) -> tuple[Array, int]:
    """Return what the sensors are said to make of the truth, and which of its columns is meant."""
    record, data = flown.record, flown.data
    speed = float(data.airspeed_mps[record.t_s > 6.0].mean())
    u, v, w = data.velocity_mps.T
    if column in ("p_radps", "q_radps", "r_radps"):
        return behind(record, record.states[:, 3:6], imu_response(record, 0)), "pqr".index(
            column[0]
        )
    if column in ("ax_mps2", "ay_mps2", "az_mps2"):
        force = behind(record, record.specific_force_mps2, imu_response(record, 1))
        return force, "xyz".index(column[1])
    names = ("alpha_a_rad", "alpha_b_rad", "beta_a_rad", "beta_b_rad")
    if column in names:
        k = names.index(column)
        angle = np.arctan2(w, u) if k < 2 else np.arctan2(v, u)
        return behind(record, angle[:, None], vane_response(record, speed, k)), 0
    if column in ("differential_a_pa", "differential_b_pa"):
        k = int(column == "differential_b_pa")
        return behind(record, data.qbar_pa[:, None], pitot_response(record, k)), 0
    raise KeyError(column)


COLUMNS = (
    "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2",
    "alpha_a_rad", "alpha_b_rad", "beta_a_rad", "beta_b_rad",
    "differential_a_pa", "differential_b_pa",
)  # fmt: skip


@pytest.mark.parametrize("column", COLUMNS)
def test_a_channel_is_as_late_as_it_is_said_to_be(flown: Flown, column: str) -> None:
    expected, k = expected_of(flown, column)
    measured = flown.table[column].to_numpy()
    late = left_over_s(flown.record.t_s, expected, flown.at_s, measured, k)
    print(f"{column} {late * 1e3:+.4f} ms")
    assert abs(late) < LIMIT_S
    # A quarter of a millisecond more would be seen.
    seen = left_over_s(flown.record.t_s, expected, flown.at_s - 2.5e-4, measured, k)
    assert seen < -LIMIT_S


def test_the_truth_file_states_these_delays(flown: Flown) -> None:
    stated = summary(flown.record, flown.data)["delay_s"]
    assert isinstance(stated, dict)
    speed = flown.record.aircraft.scalar("trim.airspeed_mps")
    responses = {
        "gyro": (imu_response(flown.record, 0), FILTERS[3][0][1]),
        "accelerometer": (imu_response(flown.record, 1), FILTERS[3][1][1]),
        "alpha_a": (vane_response(flown.record, speed, 0), 0.0),
        "beta_b": (vane_response(flown.record, speed, 3), 0.0),
        "dp_b": (pitot_response(flown.record, 1), 0.0),
    }
    slow = np.array([0.1])
    for name, (response, removed_s) in responses.items():
        late = -float(np.angle(response(slow))[0]) / 0.1 + removed_s
        assert stated[name] == pytest.approx(late, abs=1e-7), name


@pytest.mark.parametrize(
    ("name", "state"),
    [("pot_elevator", 13), ("pot_aileron_left", 14), ("pot_aileron_right", 14), ("pot_rudder", 15)],
)
def test_a_potentiometer_is_read_when_the_schema_says(flown: Flown, name: str, state: int) -> None:
    # Not from the table: a surface moves in the receiver's steps of 20 ms, and a straight line over
    # 10 ms through such a corner is up to 0.2 ms off where rows and steps keep in step.
    ident = flown.log.frames["ident"]
    delay_us = constant_delay_us(flown.log.schema.by_name["ident"].field(name), 3)
    at_s = (ident["t_us"].astype(float) - delay_us) * 1e-6 / (1.0 + clock_share(flown.record))
    surface = flown.record.states[:, state : state + 1]
    late = left_over_s(flown.record.t_s, surface, at_s, ident[name].astype(float), 0)
    print(f"{name} {late * 1e3:+.4f} ms")
    assert abs(late) < LIMIT_S
    seen = left_over_s(flown.record.t_s, surface, at_s - 2.5e-4, ident[name].astype(float), 0)
    assert seen < -LIMIT_S


def test_the_barometer_is_dated_in_the_middle_of_its_conversion(flown: Flown) -> None:
    baro = flown.log.frames["baro"]
    at_s = baro["t_us"] * 1e-6 / (1.0 + clock_share(flown.record))
    pressure = baro["static_pressure"] / 16.0
    late = left_over_s(flown.record.t_s, flown.data.static_pa[:, None], at_s, pressure, 0)
    assert abs(late) < LIMIT_S
    assert left_over_s(
        flown.record.t_s, flown.data.static_pa[:, None], at_s - 2.5e-4, pressure, 0
    ) == pytest.approx(late - 2.5e-4, abs=2e-5)


def test_the_gps_is_late_by_its_drawn_latency(flown: Flown) -> None:
    gps = flown.log.frames["gps"]
    at_s = gps["t_us"] * 1e-6 / (1.0 + clock_share(flown.record))
    late = at_s - (gps["itow_ms"].astype(np.int64) - FIRST_ITOW_MS) * 1e-3
    drawn = GPS_LATENCY_S * (1.0 + flown.record.draws.scalar("gps_delay_share"))
    # Stamped when the main loop takes the byte.
    assert abs(late.mean() - drawn) < 3.0 * LIMIT_S


def test_angles_are_carried_on_by_the_delay_of_their_rates() -> None:
    """A steady oscillation in roll with ideal gravity: nothing but time is left to differ."""
    step_s, late_s, size, w = 0.005, 0.0048, 0.3, 2.0 * np.pi * 1.1
    t = np.arange(0.0, 20.0, step_s)
    seen = t - late_s
    rates = np.zeros((len(t), 3))
    rates[:, 0] = size * w * np.cos(w * seen)
    angle = size * np.sin(w * seen)
    force = -GRAVITY_MPS2 * np.column_stack([np.zeros_like(t), np.sin(angle), np.cos(angle)])
    still = np.zeros_like(t)
    start = np.array([angle[0], 0.0, 0.0])

    def late(carry_s: float) -> float:
        angles, kept = np.zeros_like(rates), np.zeros((4, 3))
        complementary(
            rates, force, still, still, step_s, carry_s, 0, len(t), 0, turned_to(start), kept,
            angles, np.zeros_like(rates),
        )  # fmt: skip
        true = size * np.sin(w * t)
        return left_over_s(t, true[:, None], t, angles[:, 0], 0)

    assert abs(late(late_s)) < 5e-5
    assert late(0.0) == pytest.approx(late_s, abs=5e-5)


@pytest.mark.parametrize("still", [True, False])
def test_the_attitude_filter_learns_the_zeros_of_the_gyros_at_rest(*, still: bool) -> None:
    """A zero of 20 deg/s turns it for ever (MPU-6000 data sheet); a moving hand is no rest."""
    step_s, resting = 0.005, 1000
    zero = np.radians([20.0, -20.0, 10.0])
    rates = np.tile(zero, (4000, 1))
    rates[:resting, 0] += 0.0 if still else 0.1 * np.sin(0.01 * np.arange(resting))
    force = np.tile([0.0, 0.0, -GRAVITY_MPS2], (len(rates), 1))
    level, angles, biases = np.zeros(len(rates)), np.zeros_like(rates), np.zeros_like(rates)
    complementary(
        rates, force, level, level, step_s, 0.0, 0, len(rates), resting, np.eye(3),
        np.zeros((4, 3)), angles, biases,
    )  # fmt: skip
    assert np.allclose(biases[resting - 1], zero, atol=1e-6) is still
    tilt_rad = np.abs(angles[-2000:, :2]).max()
    assert tilt_rad < np.radians(20.0) if still else tilt_rad > 1.0


def test_a_pole_and_a_vane_lag_behind_a_steady_turn_by_what_they_are_given() -> None:
    t = np.arange(0.0, 3.0, STEP_S)
    ramp = 0.1 * t
    settled = t > 1.0
    slow = first_order(ramp, 3.8e-3, STEP_S)
    assert np.abs(t - slow / 0.1 - 3.8e-3)[settled].max() < 1e-7
    # 14 Hz at 17 m/s, damping 0.35: 8 ms.
    speed = np.full_like(t, 17.0)
    angle = vane(ramp, speed, 14.0 / 17.0, 0.35, 0.0, 17.0, STEP_S)
    assert np.abs(t - angle / 0.1 - 2 * 0.35 / (2 * np.pi * 14.0))[settled].max() < 2e-6
