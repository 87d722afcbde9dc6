"""Virtual flights through both attitude algorithms, and their errors against the truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from host.aircraft.airframe import DOWN, NORTH, Q0, Q3
from host.aircraft.attitude import euler
from host.twin.flight.fly import STEP_S, FlightRecord, fly
from host.twin.sensors.filters import delayed
from host.twin.sensors.imu import FIELD_NED_T, imu
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard.cards import load
from numpy.typing import NDArray

from tests.attitude import dcm, library

CARDS = Path(__file__).parent / "cards"
SETTLE_S = 5.0  # of flight, not judged
GPS_PERIOD_S = 0.2
GPS_LATE_S = 0.15
COMPASS_PERIOD_S = 1.0 / 15.0
LSB_PER_T = 1090.0 / 1e-4
SPEEDS = ("none", "gps", "airspeed")
DECLINATION_RAD = float(np.arctan2(FIELD_NED_T[1], FIELD_NED_T[0]))

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Flown:
    """One flight as the IMU sees it, at 200 Hz; what is measured and what is true."""

    record: FlightRecord
    data: AirData
    t_s: Array
    true_rad: Array  # (n, 3) phi theta psi
    raw: NDArray[np.int16]  # (n, 6) as in the packet
    field: NDArray[np.int16]  # (n, 3), zero where the magnetometer is not read
    judged: NDArray[np.bool_]


def fly_card(name: str, seed: int) -> Flown:
    """Fly a card of `cards/` once."""
    record = fly(load(CARDS / f"{name}.toml"), seed=seed)
    data = air_data(record)
    t_s = np.arange(0.02, record.t_s[-1] - 0.02, 0.005)
    seen = imu(record, data, t_s, 2, np.random.default_rng(seed))
    field = np.zeros((len(t_s), 3), np.int16)
    due = np.unique(np.searchsorted(t_s, np.arange(0.1, t_s[-1], COMPASS_PERIOD_S)))
    field[due] = np.round(seen.magnetic_t[due] * LSB_PER_T).astype(np.int16)
    begin_s = record.card.flight.ground_s + SETTLE_S
    return Flown(record, data, t_s, true_angles(record, t_s), seen.raw[:, :6], field, t_s > begin_s)


def true_angles(record: FlightRecord, at_s: Array) -> Array:
    """Return phi, theta, psi (n, 3) in rad at `at_s`."""
    angles = np.column_stack([np.unwrap(a) for a in euler(record.states[:, Q0 : Q3 + 1])])
    return np.asarray(delayed(record.t_s, angles, 0.0, at_s), np.float64)


def speed_mps(flown: Flown, at_s: Array, source: str) -> Array:
    """Return the speed the IMU knows at `at_s`, held between arrivals; 0 is none."""
    if source == "none":
        return np.zeros(len(at_s))
    if source == "airspeed":
        return np.asarray(np.interp(at_s, flown.record.t_s, flown.data.airspeed_mps), np.float64)
    ground = np.linalg.norm(
        np.gradient(flown.record.states[:, NORTH : DOWN + 1], STEP_S, axis=0)[:, :2], axis=1
    )
    ground[flown.record.t_s < flown.record.card.flight.ground_s + 2 * STEP_S] = 0.0
    heard_s = np.floor(at_s / GPS_PERIOD_S) * GPS_PERIOD_S - GPS_LATE_S
    return np.asarray(np.interp(heard_s, flown.record.t_s, ground), np.float64)


def ours(
    flown: Flown, source: str = "gps", settings: library.Settings | None = None
) -> library.Estimate:
    """Run the firmware's filter at 200 Hz."""
    speed = np.clip(speed_mps(flown, flown.t_s, source) * 100.0, 0, 65535).astype(np.uint16)
    return library.run(
        flown.raw[:, :3], flown.raw[:, 3:], speed_cmps=speed, field=flown.field, settings=settings
    )


def original(flown: Flown, source: str = "gps") -> tuple[Array, Array]:
    """Run the original algorithm as its board samples: 50 Hz, 20 Hz low-pass; (t, angles)."""
    t_s = flown.t_s[::4]
    seen = imu(flown.record, flown.data, t_s, 4, np.random.default_rng(flown.record.seed))
    # Its start-up takes the mean of the gyros on the ground for their zero.
    ground = (t_s > 1.0) & (t_s < flown.record.card.flight.ground_s - 0.5)
    angles = dcm.run(
        seen.rates_radps - seen.rates_radps[ground].mean(axis=0),
        seen.force_mps2,
        field=seen.magnetic_t,
        declination_rad=DECLINATION_RAD,
        speed_mps=speed_mps(flown, t_s, source),
    )
    return t_s, angles


@dataclass(frozen=True, slots=True)
class Errors:
    """rms and largest error of phi, theta, psi, in degrees."""

    rms_deg: Array
    most_deg: Array


def errors(estimate_rad: Array, true_rad: Array) -> Errors:
    """Compare angles (n, 3)."""
    off = np.rad2deg(np.mod(estimate_rad - true_rad + np.pi, 2 * np.pi) - np.pi)
    return Errors(np.sqrt((off**2).mean(axis=0)), np.abs(off).max(axis=0))


def judge(flown: Flown, source: str = "gps") -> tuple[Errors, Errors]:
    """Return the errors of the firmware's filter and of the original algorithm."""
    mine = ours(flown, source).angles_rad
    _, theirs = original(flown, source)
    judged = flown.judged
    return (
        errors(mine[judged], flown.true_rad[judged]),
        errors(theirs[judged[::4]], flown.true_rad[::4][judged[::4]]),
    )


def rms_of(several: list[Errors]) -> Array:
    """Return the rms (3,) over flights of equal weight, in degrees."""
    return np.asarray(np.sqrt(np.mean([each.rms_deg**2 for each in several], axis=0)), np.float64)


def most_of(several: list[Errors]) -> Array:
    """Return the largest error (3,) of all flights, in degrees."""
    return np.asarray(np.max([each.most_deg for each in several], axis=0), np.float64)
