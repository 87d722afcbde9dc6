"""A flight as an ArduPilot plane logs it: messages, rates, parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from host.aircraft.airframe import Array
from host.export.dataflash_writer import Records, write_dataflash
from host.twin.flight.fly import FlightRecord
from host.twin.outcome.autopilot_outputs import ARDUPILOT, ardupilot_pulses, demands
from host.twin.sensors.autopilot_sensors import (
    DLPF,
    Rates,
    Senses,
    autopilot_senses,
    pressure_height_m,
)
from host.twin.sensors.local_flow import AirData
from host.twin.sensors.sensor_delays import FILTERS

# ArduPlane: the loop of 50 Hz writes IMU and, with LOG_BITMASK's bit 20, ATT; RCOU comes at 25 Hz.
RATES = Rates(imu=50.0, attitude=50.0, airspeed=10.0, baro=10.0, gps=5.0, outputs=25.0)
FIRMWARE = "ArduPlane V4.5.7 (simulated)"
LOG_BITMASK = 65_535 | 1 << 20
MANUAL = 0
OUTPUTS = 14


def write_ardupilot_log(
    record: FlightRecord, data: AirData, path: Path, *, airframe: str = "conventional"
) -> Senses:
    """Write a DataFlash log of a flight; return what its sensors said.

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
    write_dataflash(path, _records(record, senses, airframe))
    return senses


def ardupilot_parameters(airframe: str) -> dict[str, float]:
    """Return the parameters that say how outputs move surfaces, and what is logged."""
    found: dict[str, float] = {
        "LOG_BITMASK": LOG_BITMASK,
        "SCHED_LOOP_RATE": RATES.imu,
        "INS_GYRO_FILTER": FILTERS[DLPF][0][0],
        "INS_ACCEL_FILTER": FILTERS[DLPF][1][0],
        "ARSPD_TYPE": 1,
        "ARSPD_USE": 1,
        "SERVO_RATE": 50,
    }
    for number, servo in enumerate(ARDUPILOT[airframe], start=1):
        found[f"SERVO{number}_FUNCTION"] = servo.function
        found[f"SERVO{number}_MIN"] = servo.low_us
        found[f"SERVO{number}_MAX"] = servo.high_us
        found[f"SERVO{number}_TRIM"] = servo.trim_us
        found[f"SERVO{number}_REVERSED"] = float(servo.turned)
    return found


def _records(record: FlightRecord, senses: Senses, airframe: str) -> list[Records]:
    parameters = ardupilot_parameters(airframe)
    start = np.zeros(len(parameters))
    rates, force = senses.rates_radps.T, senses.force_mps2.T
    angles = np.rad2deg(senses.attitude_rad)
    pulses = ardupilot_pulses(demands(record, senses.outputs_s, airframe), airframe)
    idle = np.zeros(len(senses.outputs_s))
    down = senses.velocity_mps
    return [
        Records("MSG", "QZ", {"TimeUS": np.zeros(1), "Message": [FIRMWARE]}),
        Records("PARM", "QNff", {"TimeUS": start, "Name": list(parameters),
                                 "Value": list(parameters.values()), "Default": start}),
        Records("MODE", "QMBB", {"TimeUS": np.zeros(1), "Mode": [MANUAL], "ModeNum": [MANUAL],
                                 "Rsn": [1]}),
        Records("IMU", "QBffffffIIfBBHH", {
            "TimeUS": _us(senses.imu_s), "I": np.zeros(len(senses.imu_s)),
            **dict(zip(("GyrX", "GyrY", "GyrZ"), rates, strict=True)),
            **dict(zip(("AccX", "AccY", "AccZ"), force, strict=True)),
            **_constant(senses.imu_s, EG=0, EA=0, T=35, GH=1, AH=1, GHz=1000, AHz=1000),
        }),
        Records("ATT", "QccccCCCCB", {
            "TimeUS": _us(senses.attitude_s), "DesRoll": angles[:, 0], "Roll": angles[:, 0],
            "DesPitch": angles[:, 1], "Pitch": angles[:, 1],
            "DesYaw": np.mod(angles[:, 2], 360.0), "Yaw": np.mod(angles[:, 2], 360.0),
            **_constant(senses.attitude_s, ErrRP=0, ErrYaw=0, AEKF=3),
        }),
        Records("ARSP", "QBffcffBBB", {
            "TimeUS": _us(senses.airspeed_s), "I": np.zeros(len(senses.airspeed_s)),
            "Airspeed": senses.indicated_mps, "DiffPress": senses.differential_pa,
            **_constant(senses.airspeed_s, Temp=25),
            "RawPress": senses.differential_pa, **_constant(senses.airspeed_s, Offset=0, U=1, H=1,
                                                            Pri=0),
        }),
        Records("BARO", "QBffcfIfffB", {
            "TimeUS": _us(senses.baro_s), "I": np.zeros(len(senses.baro_s)),
            "Alt": pressure_height_m(senses.static_pa), "Press": senses.static_pa,
            "Temp": senses.temperature_degc + 20.0, "CRt": np.zeros(len(senses.baro_s)),
            "SMS": senses.baro_s * 1e3,
            **_constant(senses.baro_s, Offset=0, GndTemp=float(senses.temperature_degc[0]),
                        AltE=0, H=1),
        }),
        Records("GPS", "QBBIHBcLLeffff", {
            "TimeUS": _us(senses.gps_s), **_constant(senses.gps_s, I=0, Status=3),
            "GMS": senses.gps_s * 1e3, **_constant(senses.gps_s, GWk=2300, NSats=12, HDop=0.8),
            "Lat": senses.latitude_deg, "Lng": senses.longitude_deg, "Alt": senses.height_m,
            "Spd": np.hypot(down[:, 0], down[:, 1]),
            "GCrs": np.mod(np.rad2deg(np.arctan2(down[:, 1], down[:, 0])), 360.0),
            "VZ": down[:, 2], "Yaw": np.zeros(len(senses.gps_s)),
        }),
        Records("RCOU", "Q" + OUTPUTS * "H", {
            "TimeUS": _us(senses.outputs_s),
            **{f"C{k + 1}": pulses[k] if k < len(pulses) else idle for k in range(OUTPUTS)},
        }),
        Records("VIBE", "QBfffI", {
            "TimeUS": _us(senses.baro_s),
            **_constant(senses.baro_s, IMU=0, VibeX=3, VibeY=3, VibeZ=4, Clip=0),
        }),
    ]  # fmt: skip


def _us(t_s: Array) -> Array:
    return np.round(t_s * 1e6)


def _constant(t_s: Array, **values: float) -> dict[str, Array]:
    return {name: np.full(len(t_s), value, dtype=np.float64) for name, value in values.items()}
