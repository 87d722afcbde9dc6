"""PX4 ULog by pyulog, with checks that pyulog lacks: where messages stop, impossible values."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.files.watched import watched_file
from host.readers.autopilot_log import AutopilotLog, Messages, NotAutopilotLogError
from host.readers.plausible_times import plausible_times
from host.readers.ulog_walk import walk

WANTED = (
    "sensor_combined", "vehicle_angular_velocity", "vehicle_acceleration", "vehicle_attitude",
    "airspeed", "airspeed_validated", "differential_pressure", "vehicle_air_data",
    "vehicle_local_position", "vehicle_gps_position", "sensor_gps", "actuator_servos",
    "actuator_outputs", "actuator_motors", "actuator_controls_0", "actuator_controls_1",
    "vehicle_torque_setpoint", "vehicle_thrust_setpoint", "autotune_attitude_control_status",
    "vehicle_status", "vehicle_land_detected", "vehicle_imu_status",
)  # fmt: skip
# Fields of topics that come with every sample.
LARGE = {
    "sensor_combined": ("gyro_rad", "accelerometer_m_s2"), "vehicle_attitude": ("q",),
    "vehicle_angular_velocity": ("xyz",), "vehicle_acceleration": ("xyz",),
}  # fmt: skip
OUTPUTS = ("actuator_servos", "actuator_motors")
# vehicle_status.vehicle_type, and MAV_TYPE of MAVLink's common.xml.
BY_STATUS = {1: "copter", 2: "plane", 3: "rover", 4: "airship"}
BY_MAV_TYPE = {
    1: "plane", 2: "copter", 3: "copter", 4: "helicopter", 7: "airship", 8: "balloon",
    10: "rover", 11: "boat", 12: "submarine", 13: "copter", 14: "copter", 15: "copter",
    19: "vtol", 20: "vtol", 21: "vtol", 22: "vtol", 23: "vtol", 24: "vtol", 25: "vtol",
}  # fmt: skip


def read_ulog(path: Path) -> AutopilotLog:
    """Read a ULog.

    Raises
    ------
    NotAutopilotLogError
        If pyulog finds no message in it.
    ModuleNotFoundError
        If pyulog is missing.
    """
    from pyulog import ULog

    try:
        # It prints what it does not know, and leaves a file open that it cannot read.
        with watched_file(path) as file, contextlib.redirect_stdout(io.StringIO()):
            log = ULog(file, list(WANTED), disable_str_exceptions=True)
    except Exception as error:  # pyulog names no common ancestor of what damaged files raise
        raise NotAutopilotLogError(
            f"{path}: pyulog cannot read it ({type(error).__name__}: {str(error)[:80]}); is the"
            " file cut in its head or overwritten?"
        ) from None
    damage, lost = _damage(path, log)
    messages = _messages(log, damage)
    parameters = {
        str(k): float(v) for k, v in log.initial_parameters.items() if isinstance(v, int | float)
    }
    said = {str(k): str(v) for k, v in log.msg_info_dict.items() if isinstance(v, str)}
    if not messages and not parameters:
        raise NotAutopilotLogError(
            f"{path}: begins as a ULog but holds no message that is known; is it cut?"
        )
    firmware = " ".join(said[k] for k in ("sys_name", "ver_sw_branch", "ver_hw") if k in said)
    return AutopilotLog(
        path=path,
        format="ulog",
        autopilot="px4",
        vehicle=_vehicle(messages, parameters),
        firmware=firmware,
        messages=messages,
        parameters=parameters,
        damage=tuple(damage),
        lost=lost,
    )


def _damage(path: Path, log: Any) -> tuple[list[str], int]:
    said, lost = [], 0
    found = walk(path)
    if found.strange:
        said.append(
            f"{found.strange} bytes from byte {found.strange_at} on are no messages: the format has"
            " no checksum, messages before and after may be wrong too"
        )
        lost += 1
    if found.rest:
        said.append(f"its last message is cut after {found.rest} bytes: the log is truncated")
        lost += 1
    if log.file_corruption and not found.strange:
        said.append("pyulog met messages that it could not read")
        lost += 1
    if log.dropouts:
        gone_ms = sum(d.duration for d in log.dropouts)
        said.append(f"the card was too slow {len(log.dropouts)} times: {gone_ms} ms are missing")
        lost += len(log.dropouts)
    return said, lost


def _messages(log: Any, damage: list[str]) -> dict[str, dict[int, Messages]]:
    """Return the messages of each topic; what pyulog holds of it is given up, small ones first.

    A gigabyte is in memory once, and of a topic only what is read is there twice.
    """
    found: dict[str, dict[int, Messages]] = {}
    log.data_list.sort(key=lambda data: sum(v.nbytes for v in data.data.values()), reverse=True)
    while log.data_list:
        data = log.data_list.pop()
        name, instance = str(data.name), int(data.multi_id)
        messages = _topic(name, data.data, damage)
        if messages is not None:
            found.setdefault(name, {})[instance] = messages
    return dict(sorted(found.items()))


def _topic(name: str, data: Mapping[str, NDArray[Any]], damage: list[str]) -> Messages | None:
    """Return the messages of one topic, copied."""
    stamps = data.get("timestamp")
    if stamps is None or not len(stamps):
        return None
    sampled = data.get("timestamp_sample")
    use = sampled if sampled is not None and (sampled > 0).mean() > 0.9 else stamps
    t_s = np.asarray(use, dtype=np.float64) * 1e-6
    kept, wrong = plausible_times(t_s)
    if wrong:
        damage.append(f"{wrong} messages of {name} have an impossible time, left out")
    rows = np.flatnonzero(kept)
    # A topic may be published twice for one sample: the first counts.
    rows = rows[np.concatenate([[True], np.diff(t_s[rows]) > 0.0])] if len(rows) else rows
    if not len(rows):
        return None
    own = {}
    for key, values in data.items():
        if len(values) != len(stamps) or not _read(name, str(key)):
            continue
        column = values[rows]
        # Outputs that nothing is assigned to are most of them.
        if name not in OUTPUTS or not np.isnan(column).all():
            own[str(key)] = column
    return Messages(t_s[rows], own)


def _read(name: str, key: str) -> bool:
    """Return whether a field is read: of large topics only some are."""
    if name in LARGE:
        return key.partition("[")[0] in LARGE[name]
    return key not in ("timestamp", "timestamp_sample")


def _vehicle(messages: dict[str, dict[int, Messages]], parameters: dict[str, float]) -> str:
    status = messages.get("vehicle_status", {}).get(0)
    fields = status.fields if status is not None else {}
    if "is_vtol" in fields and bool(np.any(fields["is_vtol"] == 1)):
        return "vtol"
    if "vehicle_type" in fields:
        return BY_STATUS.get(int(np.median(fields["vehicle_type"])), "")
    if "is_rotary_wing" in fields and bool(np.all(fields["is_rotary_wing"] == 1)):
        return "copter"
    return BY_MAV_TYPE.get(int(parameters.get("MAV_TYPE", 0)), "")
