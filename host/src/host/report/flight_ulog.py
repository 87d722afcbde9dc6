"""A flight as ULog: every column at full rate, attitude, IMU and GPS under PX4's names as well."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array
from host.export.ulog_writer import Topic, topic, write_ulog
from host.report.exported_rows import exported_rows
from host.report.shown_flight import ShownFlight

TABLE = "flight_test"  # the topic with all of our columns
_DOUBLE = ("latitude_deg", "longitude_deg")  # 24 bits are 2 m
_RATES = ("p_radps", "q_radps", "r_radps")
_FORCES = ("ax_mps2", "ay_mps2", "az_mps2")
_ANGLES = ("phi_rad", "theta_rad", "psi_rad")
_START_US = 1_000_000  # of the first row: ULog has no time before its header's


def write_flight_ulog(flight: ShownFlight, path: Path) -> None:
    """Write a flight as ULog.

    Units stand in the columns' names; the calibration is in the parameters (``CAL_...``) and its
    file in the information; events are logged texts. What was not measured is NaN.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    columns = exported_rows(flight)
    first_s = float(columns["t_s"][0])
    for one in flight.events:
        first_s = min(first_s, one.t_s)

    def us(t_s: Array) -> NDArray[np.uint64]:
        return np.asarray(np.round((t_s - first_s) * 1e6) + _START_US, np.uint64)

    timestamp = us(columns["t_s"])
    table: dict[str, Any] = {
        name: values.astype(np.float64 if name in ("t_s", *_DOUBLE) else np.float32)
        for name, values in columns.items()
    }
    topics = [topic(TABLE, timestamp=timestamp, **table), *_px4_topics(columns, timestamp)]
    if flight.position:
        topics.append(_gps_topic(flight, us(flight.position["t_s"])))
    own = flight.summary.get("calibration") or {}
    write_ulog(
        path,
        topics,
        parameters={f"CAL_{name}": value for name, value in flight.calibration.items()},
        information=_information(flight, own),
        start_us=_START_US,
        said=[(int(us(np.array([one.t_s]))[0]), one.text) for one in flight.events],
    )


def _information(flight: ShownFlight, calibration: dict[str, Any]) -> dict[str, str]:
    aircraft = {s["aircraft"] for s in flight.summary.get("sessions", ()) if s.get("aircraft")}
    found = {
        "sys_name": "flight-test logger",
        "source": flight.name,
        "aircraft": ", ".join(sorted(aircraft)),
        "complete": flight.summary["complete"],
        "losses": str(len(flight.summary["losses"]["ranges"])),
        "calibration_name": str(calibration.get("name") or ""),
        "calibration_date": str(calibration.get("date") or ""),
        "calibration": flight.calibration_text[:30_000],
    }
    return {name: text for name, text in found.items() if text}


def _px4_topics(columns: dict[str, Array], timestamp: NDArray[np.uint64]) -> list[Topic]:
    """Return the topics that PX4's tools look for, from the rows that have values."""
    made = []
    if {*_RATES, *_FORCES} <= columns.keys():
        rates = np.column_stack([columns[name] for name in _RATES])
        forces = np.column_stack([columns[name] for name in _FORCES])
        known = np.isfinite(rates).all(axis=1) & np.isfinite(forces).all(axis=1)
        made.append(
            topic("sensor_combined", timestamp=timestamp[known],
                  gyro_rad=rates[known].astype(np.float32),
                  accelerometer_m_s2=forces[known].astype(np.float32))
        )  # fmt: skip
    if set(_ANGLES) <= columns.keys():
        angles = [columns[name] for name in _ANGLES]
        known = np.isfinite(np.column_stack(angles)).all(axis=1)
        turned = np.column_stack(_quaternions(*(one[known] for one in angles)))
        made.append(topic("vehicle_attitude", timestamp=timestamp[known],
                          q=turned.astype(np.float32)))  # fmt: skip
    return made


def _quaternions(phi: Array, theta: Array, psi: Array) -> tuple[Array, Array, Array, Array]:
    """Return w, x, y, z of Euler angles in the order yaw, pitch, roll, for whole columns."""
    cr, sr, cp, sp = np.cos(phi / 2), np.sin(phi / 2), np.cos(theta / 2), np.sin(theta / 2)
    cy, sy = np.cos(psi / 2), np.sin(psi / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _gps_topic(flight: ShownFlight, timestamp: NDArray[np.uint64]) -> Topic:
    own = flight.position
    return topic(
        "vehicle_gps_position",
        timestamp=timestamp,
        latitude_deg=own["latitude_deg"],
        longitude_deg=own["longitude_deg"],
        altitude_msl_m=own["height_m"],
        fix_type=np.full(len(timestamp), 3, np.uint8),
    )
