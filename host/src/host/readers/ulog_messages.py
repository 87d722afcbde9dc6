"""PX4 ULog as messages: which topics and columns are read, and when they were sampled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from host.arrays import Array
from host.readers.autopilot_log import (
    AutopilotLog,
    Messages,
    NotAutopilotLogError,
    last_time_s,
)
from host.readers.clock_epochs import clock_origin_s
from host.readers.plausible_times import plausible_times
from host.readers.ulog_binary import SAID, Topic, ULogContent, UnknownFlagsError, read_content
from host.readers.written_parameters import Parameters

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
STAMPS = ("timestamp", "timestamp_sample")
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
        If there is no message in it that is read.
    """
    try:
        log = read_content(path, WANTED.__contains__, _read)
    except UnknownFlagsError:
        raise NotAutopilotLogError(
            f"{path}: its flags name a way of reading that this program does not know; is it"
            " damaged, or of a newer PX4?"
        ) from None
    damage, lost = _damage(log)
    origin_s = clock_origin_s(
        topic.first("timestamp") * 1e-6 for topic in log.topics if _is_timed(topic)
    )
    messages = _messages(log, origin_s, damage)
    if not messages and not log.written:
        raise NotAutopilotLogError(
            f"{path}: begins as a ULog but holds no message that is known; is it cut?"
        )
    end_s = last_time_s(messages)
    parameters = Parameters(
        [(name, value, at_us * 1e-6 - origin_s) for name, value, at_us in log.written], end_s
    )
    return AutopilotLog(
        path=path,
        format="ulog",
        autopilot="px4",
        vehicle=_vehicle(messages, parameters),
        firmware=" ".join(log.said[k] for k in SAID if k in log.said),
        messages=messages,
        parameters=parameters,
        damage=tuple(damage),
        lost=lost,
        remarks=tuple(
            f"{name} is defined twice: the first definition counts" for name in log.twice[:5]
        ),
    )


def _damage(log: ULogContent) -> tuple[list[str], int]:
    said = []
    if log.strange:
        said.append(
            f"{log.strange} bytes from byte {log.strange_at} on are no messages: the format has"
            " no checksum, messages before and after may be wrong too"
        )
    if log.rest:
        said.append(f"its last message is cut after {log.rest} bytes: the log is truncated")
    lost = len(said)
    if log.refused:
        first = next(iter(log.refused.values()))
        said.append(f"{len(log.refused)} definitions are not followed, the first: {first}")
        lost += 1
    if log.dropouts:
        said.append(f"the card was too slow {log.dropouts} times: {log.dropped_ms} ms are missing")
        lost += log.dropouts
    return said, lost


def _messages(
    log: ULogContent, origin_s: float, damage: list[str]
) -> dict[str, dict[int, Messages]]:
    """Return the messages of each topic; what was read of it is given up, small ones first.

    A gigabyte is in memory once, and of a topic only what is read is there twice.
    """
    found: dict[str, dict[int, Messages]] = {}
    log.topics.sort(key=lambda topic: len(topic.data), reverse=True)
    while log.topics:
        topic = log.topics.pop()
        messages = _topic(topic, origin_s, damage)
        if messages is not None:
            found.setdefault(topic.name, {})[topic.instance] = messages
    return dict(sorted(found.items()))


def _is_timed(topic: Topic) -> bool:
    return "timestamp" in topic.columns and bool(topic.data)


def _times(topic: Topic) -> Array:
    """Return when each message was sampled, s, by the clock of the log."""
    use = topic.column("timestamp")
    if "timestamp_sample" in topic.columns:
        sampled = topic.column("timestamp_sample")
        use = sampled if (sampled > 0).mean() > 0.9 else use
    return np.asarray(use, dtype=np.float64) * 1e-6


def _topic(topic: Topic, origin_s: float, damage: list[str]) -> Messages | None:
    """Return the messages of one topic, column by column."""
    name, columns = topic.name, topic.columns
    if not _is_timed(topic):
        return None
    t_s = _times(topic) - origin_s
    kept, wrong = plausible_times(t_s)
    if wrong:
        damage.append(f"{wrong} messages of {name} have an impossible time, left out")
    rows = np.flatnonzero(kept)
    # A topic may be published twice for one sample: the first counts.
    rows = rows[np.concatenate([[True], np.diff(t_s[rows]) > 0.0])] if len(rows) else rows
    if not len(rows):
        return None
    every: Any = slice(None) if len(rows) == len(t_s) else rows  # then nothing is copied
    own = {}
    for key in columns:
        if key in STAMPS:
            continue
        column = topic.column(key)[every]
        # Outputs that nothing is assigned to are most of them.
        if name not in OUTPUTS or not np.isnan(column).all():
            own[key] = column
    return Messages(t_s[every], own)


def _read(name: str, key: str) -> bool:
    """Return whether a column is read: of large topics only some are."""
    return key in STAMPS or name not in LARGE or key.partition("[")[0] in LARGE[name]


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
