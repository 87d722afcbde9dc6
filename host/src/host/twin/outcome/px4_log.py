"""A flight as a PX4 plane logs it: topics, rates, parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array
from host.aircraft.attitude import quaternion
from host.export.ulog_writer import Topic, topic, write_ulog
from host.twin.flight.fly import FlightRecord
from host.twin.outcome.autopilot_outputs import PX4, demands, px4_controls
from host.twin.sensors.autopilot_sensors import (
    SEA_LEVEL_DENSITY_KGPM3,
    Rates,
    Senses,
    autopilot_senses,
    pressure_height_m,
)
from host.twin.sensors.local_flow import AirData

# SDLOG_PROFILE 19 (default, estimator replay, high rate): sensor_combined as the estimator gets it,
# the rest at the rate of its publisher.
RATES = Rates(imu=200.0, attitude=100.0, airspeed=20.0, baro=20.0, gps=5.0, outputs=200.0)
PROFILE = 1 | 2 | 16
FIXED_WING = 2
SERVOS, MOTORS = 8, 12


def write_px4_log(
    record: FlightRecord, data: AirData, path: Path, *, airframe: str = "conventional"
) -> Senses:
    """Write a ULog of a flight; return what its sensors said.

    Parameters
    ----------
    record : FlightRecord
    data : AirData
    path : Path
    airframe : str
        One of `autopilot_outputs.AIRFRAMES`.

    Raises
    ------
    UsageError
        If there is no such airframe.
    OSError
        The file cannot be written.
    """
    senses = autopilot_senses(record, data, RATES)
    write_ulog(
        path,
        _topics(record, senses, airframe),
        parameters=px4_parameters(airframe),
        information={"sys_name": "PX4", "ver_hw": "SIMULATED", "ver_sw_branch": "v1.15"},
    )
    return senses


def px4_parameters(airframe: str) -> dict[str, float | int]:
    """Return the parameters that say which output is which surface, and what is logged."""
    found: dict[str, float | int] = {
        "CA_AIRFRAME": 1,
        "CA_SV_CS_COUNT": len(PX4[airframe]),
        "IMU_GYRO_CUTOFF": 40.0,
        "MAV_TYPE": 1,
        "SDLOG_PROFILE": PROFILE,
        "SYS_HAS_NUM_ASPD": 1,
    }
    for k, (kind, roll, pitch, yaw) in enumerate(PX4[airframe]):
        found[f"CA_SV_CS{k}_TYPE"] = kind
        found |= {f"CA_SV_CS{k}_TRQ_{a}": float(v) for a, v in zip("RPY", (roll, pitch, yaw),
                                                                 strict=True)}  # fmt: skip
    return found


def _topics(record: FlightRecord, senses: Senses, airframe: str) -> list[Topic]:
    asked = demands(record, senses.outputs_s, airframe)
    servos = np.full((len(senses.outputs_s), SERVOS), np.nan)
    for k, control in enumerate(px4_controls(asked, airframe)):
        servos[:, k] = control
    motors = np.full((len(senses.outputs_s), MOTORS), np.nan)
    motors[:, 0] = asked["throttle"]
    turned = np.array([quaternion(*angles) for angles in senses.attitude_rad])
    outputs, baro, fixes = _us(senses.outputs_s), _us(senses.baro_s), _us(senses.gps_s)
    true = senses.indicated_mps * np.sqrt(
        SEA_LEVEL_DENSITY_KGPM3 / np.interp(senses.airspeed_s, record.t_s, record.density_kgpm3)
    )
    seconds = np.arange(0.05, record.t_s[-1], 0.5)
    on_ground = seconds < record.card.flight.ground_s
    return [
        topic("sensor_combined", timestamp=_us(senses.imu_s), gyro_rad=_f4(senses.rates_radps),
              gyro_integral_dt=_whole(senses.imu_s, 5000, "u4"),
              accelerometer_timestamp_relative=_whole(senses.imu_s, 0, "i4"),
              accelerometer_m_s2=_f4(senses.force_mps2),
              accelerometer_integral_dt=_whole(senses.imu_s, 5000, "u4"),
              accelerometer_clipping=_whole(senses.imu_s, 0, "u1")),
        topic("vehicle_attitude", timestamp=_us(senses.attitude_s),
              timestamp_sample=_us(senses.attitude_s), q=_f4(turned)),
        topic("airspeed_validated", timestamp=_us(senses.airspeed_s),
              indicated_airspeed_m_s=_f4(senses.indicated_mps),
              calibrated_airspeed_m_s=_f4(senses.indicated_mps), true_airspeed_m_s=_f4(true),
              airspeed_source=_whole(senses.airspeed_s, 1, "i1")),
        topic("vehicle_air_data", timestamp=baro, timestamp_sample=baro,
              baro_alt_meter=_f4(pressure_height_m(senses.static_pa)),
              baro_temp_celcius=_f4(senses.temperature_degc),
              baro_pressure_pa=_f4(senses.static_pa),
              rho=_f4(np.interp(senses.baro_s, record.t_s, record.density_kgpm3))),
        topic("vehicle_local_position", timestamp=fixes, timestamp_sample=fixes,
              vx=_f4(senses.velocity_mps[:, 0]), vy=_f4(senses.velocity_mps[:, 1]),
              vz=_f4(senses.velocity_mps[:, 2]),
              v_xy_valid=_whole(senses.gps_s, 1, "b1")),
        topic("actuator_servos", timestamp=outputs, timestamp_sample=outputs, control=_f4(servos)),
        topic("actuator_motors", timestamp=outputs, timestamp_sample=outputs, control=_f4(motors)),
        topic("vehicle_status", timestamp=_us(seconds),
              vehicle_type=_whole(seconds, FIXED_WING, "u1"), is_vtol=_whole(seconds, 0, "b1")),
        topic("vehicle_land_detected", timestamp=_us(seconds), landed=on_ground),
    ]  # fmt: skip


def _us(t_s: Array) -> NDArray[np.uint64]:
    return np.round(t_s * 1e6).astype(np.uint64)


def _f4(values: Array) -> NDArray[np.float32]:
    return values.astype(np.float32)


def _whole(t_s: Array, value: int, kind: str) -> NDArray[Any]:
    return np.full(len(t_s), value, dtype=kind)
