"""The thesis's own logger as a chain of sensors: rows of 10 or 20 a second, with all its faults.

Faults of its program (thesis, appendix C), numbered for the comments below: D1 the vane expression
overflows int16; D3 zeros are taken at boot, from one sample of a vane and 4 s of pressure; D4 the
halves of an IMU sample alternate and are one or two rows old; D8 altitude in whole metres with a
dead band; D9 sea-level standard pressure; D10 pressure clipped at zero and filtered twice; D11
surfaces are commands through hand-made maps; D12 no time in the row. Speed is in km/h.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from host.aircraft.airframe import DOWN, NORTH, Array
from host.constants import EARTH_RADIUS_M, GRAVITY_MPS2, RAD_PER_DEG
from host.original.printed_pulses import RANGE_US, printed_of_servo, servo_of_stick_us
from host.twin.flight.fly import STEP_S, FlightRecord
from host.twin.sensors.analog import analog, convert
from host.twin.sensors.imu import imu
from host.twin.sensors.local_flow import AirData
from host.twin.sensors.ubx import POSITION_NOISE_M, VELOCITY_NOISE_MPS

IMU_RATE_HZ = 50.0
GYRO_COUNTS_PER_DEGPS = 16.4
GRAVITY_COUNTS = 8192.0
# Times of the readings inside one turn of the loop, seconds after its start (27 ms of text follow).
VANE_AT_S = 0.004
PRESSURE_AT_S = 0.006
BOOT_READINGS = 200
GPS_RATE_HZ, GPS_LATE_S = 4.0, 0.25  # of the ArduIMU's receiver
PAIRED_HZ = 20.0  # the second flight had a set of air data sensors on either wing tip


def row_times(record: FlightRecord) -> Array:
    """Return when the loop starts each row: the nominal rate with 3 % of jitter."""
    rng = np.random.default_rng([record.seed, 20])
    period = 1.0 / record.card.flight.rate_hz
    count = int((record.t_s[-1] - 0.2) / period)
    steps = period * (1.0 + 0.03 * rng.standard_normal(count))
    at = 0.1 + np.cumsum(np.maximum(steps, 0.5 * period))
    return np.asarray(at[at < record.t_s[-1] - 0.05])


def overflowed_vane(count: Array) -> Array:
    """`analogRead * 90 / 27` in 16 bits: D1."""
    product = np.mod(count.astype(np.int64) * 90 + 32768, 65536) - 32768
    return np.trunc(product / 27)


def rows(record: FlightRecord, data: AirData) -> pd.DataFrame:
    """Return the rows of flight 1 and 2 as the thesis's program printed them.

    Parameters
    ----------
    record : FlightRecord
        Its card's rate is the row rate.
    data : AirData

    Returns
    -------
    DataFrame
        Columns named as the row's tags (``RLL`` ... ``throts``) and ``t_s``, the arrival of the
        row at the PC, which the row itself does not carry.
    """
    rng = np.random.default_rng([record.seed, 21])
    at = row_times(record)
    counts = convert(analog(record, data), record.t_s, at + VANE_AT_S, rng)
    start = convert(analog(record, data), record.t_s, np.array([0.05]), rng)[0]

    sample_at = np.arange(0.02, record.t_s[-1] - 0.02, 1.0 / IMU_RATE_HZ)
    sample = imu(record, data, sample_at, 4, rng)
    raw_rates = np.degrees(sample.rates_radps) * GYRO_COUNTS_PER_DEGPS
    raw_force = -sample.force_mps2 / GRAVITY_MPS2 * GRAVITY_COUNTS
    rest = sample_at < record.card.flight.ground_s
    if rest.any():
        # startup_ground() zeroes all six axes where the aircraft stands, and puts 1 g back on z.
        raw_rates = raw_rates - raw_rates[rest].mean(axis=0)
        raw_force = raw_force - raw_force[rest].mean(axis=0) + np.array([0.0, 0.0, GRAVITY_COUNTS])
    newest = np.searchsorted(sample_at, at, side="right") - 1
    row = np.arange(len(at))
    # D4: the slave address alternates; packet 1 arrives in even rows, packet 2 in odd ones.
    first = newest[np.maximum(row - row % 2 - 1, 0)]
    second = newest[np.maximum(row - 1 + row % 2 - 1, 0)]
    angles = np.degrees(sample.attitude_rad)

    reference = _boot_reference(record, data, rng)
    speed_kmh = [_speed_kmh(counts[:, 4 + k], reference[k]) for k in range(2)]

    altitude = _altitude(record, data, at, rng)
    pulses = record.pulses_us[
        np.maximum(np.searchsorted(record.pulse_starts_s + 0.012, at, side="right") - 1, 0)
    ]
    surfaces = {
        name: printed_of_servo(servo_of_stick_us(pulses[:, k], name), name)
        for k, name in enumerate(RANGE_US)
    }
    return pd.DataFrame(
        {
            "t_s": at + 0.03,
            "RLL": np.round(angles[first, 0], 2),
            "PCH": np.round(angles[first, 1], 2),
            "YAW": np.round(angles[first, 2], 2),
            "altitude": altitude,
            "velocity": np.round(speed_kmh[0], 2),
            "velocityb": np.round(speed_kmh[1], 2),
            "alphab": overflowed_vane(counts[:, 1]) - overflowed_vane(start[1:2])[0],
            "betab": overflowed_vane(counts[:, 3]) - overflowed_vane(start[3:4])[0],
            "alpha": overflowed_vane(counts[:, 0]) - overflowed_vane(start[:1])[0],
            "beta": overflowed_vane(counts[:, 2]) - overflowed_vane(start[2:3])[0],
            "AN0": np.round(raw_rates[first, 0], 2),
            "AN1": np.round(raw_rates[first, 1], 2),
            "AN2": np.round(raw_rates[first, 2], 2),
            "AN3": np.round(raw_force[first, 0], 2),
            "AN4": np.round(raw_force[first, 1], 2),
            "AN5": np.round(raw_force[second, 2], 2),
            **_gps(record, at),
            "elevs": np.round(surfaces["elevator"], 2),
            "ails": np.round(surfaces["aileron"], 2),
            "rdrs": np.round(surfaces["rudder"], 2),
            "throts": surfaces["throttle"],
        }
    )


def _gps(record: FlightRecord, at: Array) -> dict[str, Array]:
    """Return position, course and speed of the newest solution that had come by each row."""
    rng = np.random.default_rng([record.seed, 22])
    solved = np.arange(0.0, record.t_s[-1], 1.0 / GPS_RATE_HZ)
    place = record.states[:, NORTH : DOWN + 1]
    velocity = np.gradient(place, STEP_S, axis=0)
    velocity[np.abs(record.t_s - record.card.flight.ground_s) < 3 * STEP_S] = 0.0  # the launch
    k = np.minimum(np.rint(solved / STEP_S).astype(int), len(place) - 1)
    spot = place[k, :2] + rng.normal(0.0, POSITION_NOISE_M, (len(k), 2))
    speed = velocity[k, :2] + rng.normal(0.0, VELOCITY_NOISE_MPS, (len(k), 2))
    newest = np.maximum(np.searchsorted(solved + GPS_LATE_S, at, side="right") - 1, 0)
    flight = record.card.flight
    turn = EARTH_RADIUS_M * np.cos(np.radians(flight.latitude_deg))
    return {
        "lat": np.round(flight.latitude_deg + np.degrees(spot[:, 0] / EARTH_RADIUS_M), 5)[newest],
        "lon": np.round(flight.longitude_deg + np.degrees(spot[:, 1] / turn), 5)[newest],
        "gpsgc": np.round(np.degrees(np.arctan2(speed[:, 1], speed[:, 0])) % 360.0, 2)[newest],
        "gpsgs": np.round(np.hypot(speed[:, 0], speed[:, 1]), 2)[newest],
    }


def _speed_kmh(count: Array, reference: float) -> Array:
    kpa = _kpa(count)
    filtered = np.empty_like(kpa)
    state = reference
    for i, value in enumerate(kpa):
        state = 0.25 * value + 0.75 * state
        filtered[i] = state
    clipped = np.maximum(filtered - reference, 0.0)
    return np.asarray(np.sqrt(clipped * 1000.0 * 1.633) * 18.0 / 5.0)


def _boot_reference(record: FlightRecord, data: AirData, rng: np.random.Generator) -> Array:
    """Return both zeros of pressure (kPa): 200 readings in 4 s of boot through the same filter.

    D3. Where the flight stands for less than 4 s, the 200 readings are closer together.
    """
    last_s = max(0.05, min(4.05, record.card.flight.ground_s - 0.1))
    at = np.linspace(0.05, last_s, BOOT_READINGS)
    kpa = _kpa(convert(analog(record, data), record.t_s, at, rng)[:, 4:6])
    state = kpa[0]
    for value in kpa[1:]:
        state = 0.25 * value + 0.75 * state
    return np.asarray(state)


def _kpa(count: Array) -> Array:
    return np.asarray(((count * 5.0 / 1024.0 - 0.0625 * 4.0) / 5.0 - 0.5) / 0.2)


def _altitude(record: FlightRecord, data: AirData, at: Array, rng: np.random.Generator) -> Array:
    """Return altitude by standard sea level in whole metres, dead band 2 m: D8, D9."""
    pressure = np.interp(at + PRESSURE_AT_S, record.t_s, data.static_pa)
    pressure = pressure + rng.normal(0.0, 3.0, len(at)) + record.draws.scalar("baro_offset_pa")
    metres = np.trunc(44330.0 * (1.0 - (pressure / 101325.0) ** 0.1903))
    out = np.empty(len(at))
    kept, start = 0.0, metres[0]
    for i, value in enumerate(metres):
        change = abs(value - kept)
        if 2.0 <= change <= 100.0:
            kept = value
        out[i] = kept - start
    return out


def table(printed: pd.DataFrame) -> pd.DataFrame:
    """Return the rows in SI and in this house's signs, as well as they can be read.

    Parameters
    ----------
    printed : DataFrame
        From `rows`.

    Returns
    -------
    DataFrame
        ``t_s``, ``airspeed_mps``, ``alpha_rad`` ... as far as the rows carry them. Vanes are
        undone only within the linear range around their start value; jumps of the overflow stay
        visible.
    """
    radians = RAD_PER_DEG
    # 90/27 printed for 27/90: one printed unit is 0.3 * 27/90 count; the encoder turns 360/1024
    # deg.
    per_unit = 27.0 / 90.0 * 360.0 / 1024.0 * radians
    return pd.DataFrame(
        {
            "t_s": printed["t_s"],
            "airspeed_mps": printed["velocity"] / 3.6,
            "alpha_rad": printed["alpha"] * per_unit,
            "beta_rad": printed["beta"] * per_unit,
            **{
                f"{a}_radps": printed[f"AN{i}"] / GYRO_COUNTS_PER_DEGPS * radians
                for i, a in enumerate("pqr")
            },
            **{
                f"a{a}_mps2": -printed[f"AN{3 + i}"] / GRAVITY_COUNTS * GRAVITY_MPS2
                for i, a in enumerate("xyz")
            },
            "phi_rad": printed["RLL"] * radians,
            "theta_rad": printed["PCH"] * radians,
            "psi_rad": np.unwrap(printed["YAW"].to_numpy() * radians),
            "elevator_rad": printed["elevs"] * radians,
            "aileron_rad": printed["ails"] * radians,
            "rudder_rad": printed["rdrs"] * radians,
            "throttle": printed["throts"] / 991.0,
            "height_m": printed["altitude"],
        }
    )


def _air(row: Mapping[Hashable, float], *, paired: bool) -> str:
    if not paired:
        return f"velocity:{row['velocity']:.2f},alpha:{int(row['alpha'])},beta:{int(row['beta'])}"
    return (
        f"velocitya:{row['velocity']:.2f},velocityb:{row['velocityb']:.2f},"
        f"alphaa:{int(row['alpha'])},alphab:{int(row['alphab'])},"
        f"betaa:{int(row['beta'])},betab:{int(row['betab'])}"
    )


def write_rows(printed: pd.DataFrame, path: Path, *, paired: bool) -> None:
    """Write the rows as text, of single sensors (appendix C) or of pairs; raises OSError."""
    with path.open("w", encoding="ascii", newline="") as out:
        for row in printed.to_dict("records"):
            out.write(
                f"RLL:{row['RLL']:.2f},PCH:{row['PCH']:.2f},YAW:{row['YAW']:.2f},"
                f"altitude:{int(row['altitude'])},{_air(row, paired=paired)},"
                + ",".join(f"AN{i}:{row[f'AN{i}']:.2f}" for i in range(6))
                + f",lat:{row['lat']:.5f},lon:{row['lon']:.5f},gpsgc:{row['gpsgc']:.2f},"
                f"gpsgs:{row['gpsgs']:.2f},fix:1,numsat:9,"
                f"elevs:{row['elevs']:.2f},ails:{row['ails']:.2f},rdrs:{row['rdrs']:.2f},"
                f"throts:{int(row['throts'])},000000000000000\r\n"
            )
