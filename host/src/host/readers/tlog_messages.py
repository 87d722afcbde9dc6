"""MAVLink telemetry logs, frame by frame: pymavlink decodes and checks each frame's CRC.

Each frame stands behind the ground station's time. A message's own time since boot counts where it
has one; the radio's delay is then not in it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from host.arrays import Array
from host.readers.autopilot_log import AutopilotLog, Messages, NotAutopilotLogError
from host.readers.plausible_times import plausible
from host.readers.ulog_messages import BY_MAV_TYPE

WANTED = (
    "HEARTBEAT", "ATTITUDE", "RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "HIGHRES_IMU",
    "SERVO_OUTPUT_RAW", "VFR_HUD", "SCALED_PRESSURE", "GLOBAL_POSITION_INT", "PARAM_VALUE",
    "STATUSTEXT",
)  # fmt: skip
AUTOPILOTS = {3: "ardupilot", 12: "px4"}
STAMP_BYTES = 8
V1, V2 = 0xFE, 0xFD
GROUND_STATION, NO_AUTOPILOT = 6, 8
WRAP_US = float(1 << 32)
OTHER_CLOCK_S = 1e9  # a time since boot is shorter than thirty years


@dataclass(slots=True)
class _Frames:
    """What was decoded: messages by sender, frames of each, gaps in their numbers, wrong bytes."""

    decoded: dict[int, list[tuple[float, Any]]] = field(default_factory=dict)
    numbers: dict[tuple[int, int], list[int]] = field(default_factory=dict)
    wrong_crc: int = 0
    strange_bytes: int = 0


def read_tlog(path: Path) -> AutopilotLog:
    """Read a telemetry log.

    Raises
    ------
    NotAutopilotLogError
        If no vehicle speaks in it.
    ModuleNotFoundError
        If pymavlink is missing.
    """
    frames = _frames(path.read_bytes())
    vehicles = {system: _heartbeat(found) for system, found in frames.decoded.items()}
    known = {system: beat for system, beat in vehicles.items() if beat is not None}
    if not known:
        raise NotAutopilotLogError(
            f"{path}: no frame of a vehicle (HEARTBEAT) in it; expected a MAVLink telemetry log"
        )
    system = max(known, key=lambda s: len(frames.decoded[s]))
    damage = _damage(frames, system)
    if len(known) > 1:
        damage.append(f"{len(known)} vehicles speak in it; system {system} is read")
    beat = known[system]
    every = frames.decoded[system]
    messages, parameters, texts = _sorted(every, damage)
    return AutopilotLog(
        path=path,
        format="tlog",
        autopilot=AUTOPILOTS.get(int(beat.autopilot), "ardupilot"),
        vehicle=BY_MAV_TYPE.get(int(beat.type), ""),
        firmware=next((t for t in texts if "ardu" in t.lower() or "px4" in t.lower()), ""),
        messages=messages,
        parameters=parameters,
        damage=tuple(damage),
        lost=frames.wrong_crc + (1 if frames.strange_bytes else 0),
        texts=tuple(texts),
    )


def _frames(data: bytes) -> _Frames:
    """Decode every frame of a wanted kind."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    link = dialect.MAVLink(None)
    wanted = {getattr(dialect, f"MAVLINK_MSG_ID_{name}") for name in WANTED}
    found = _Frames()
    at, size = 0, len(data)
    while at + STAMP_BYTES + 8 <= size:
        start = data[at + STAMP_BYTES]
        if start not in (V1, V2):
            found.strange_bytes += 1
            at += 1
            continue
        first = at + STAMP_BYTES
        second = start == V2
        length = data[first + 1] + (12 if second else 8)
        length += 13 if second and data[first + 2] & 1 else 0
        frame = data[first : first + length]
        if len(frame) < length:
            break
        kind = int.from_bytes(frame[7:10], "little") if second else frame[5]
        sender = (frame[5], frame[6]) if second else (frame[3], frame[4])
        if kind in wanted:
            try:
                message = link.decode(bytearray(frame))
            except Exception:  # of a wrong CRC pymavlink raises its own, of wrong lengths others
                found.wrong_crc += 1
                at += 1
                continue
            stamp_s = int.from_bytes(data[at:first], "big") * 1e-6
            found.decoded.setdefault(sender[0], []).append((stamp_s, message))
        found.numbers.setdefault(sender, []).append(frame[4] if second else frame[2])
        at = first + length
    found.strange_bytes += size - at
    return found


def _heartbeat(found: list[tuple[float, Any]]) -> Any | None:
    beats = [
        m for _, m in found
        if m.get_type() == "HEARTBEAT" and m.type != GROUND_STATION and m.autopilot != NO_AUTOPILOT
    ]  # fmt: skip
    return beats[len(beats) // 2] if beats else None


def _damage(frames: _Frames, system: int) -> list[str]:
    said = []
    if frames.wrong_crc:
        said.append(f"{frames.wrong_crc} frames have a wrong checksum and were left out")
    if frames.strange_bytes:
        said.append(f"{frames.strange_bytes} bytes belong to no frame")
    numbers = [n for sender, n in frames.numbers.items() if sender[0] == system]
    lost = sum(int(np.sum((np.diff(n) - 1) % 256)) for n in numbers if len(n) > 1)
    total = sum(map(len, numbers))
    if lost:
        share = 100.0 * lost / (lost + total)
        said.append(f"{lost} frames ({share:.1f} %) of the vehicle never came: the radio lost them")
    return said


def _sorted(
    every: list[tuple[float, Any]], damage: list[str]
) -> tuple[dict[str, dict[int, Messages]], dict[str, float], list[str]]:
    by_name: dict[str, list[tuple[float, Any]]] = {}
    for stamp_s, message in every:
        by_name.setdefault(message.get_type(), []).append((stamp_s, message))
    parameters = {
        str(m.param_id).strip("\0"): float(m.param_value) for _, m in by_name.pop("PARAM_VALUE", [])
    }
    texts = [str(m.text).strip("\0") for _, m in by_name.pop("STATUSTEXT", [])]
    boots = [s - m.time_boot_ms * 1e-3 for s, m in by_name.get("ATTITUDE", [])]
    boot_s = float(np.median(boots)) if boots else min(s for s, _ in every)
    found: dict[str, dict[int, Messages]] = {}
    for name, some in by_name.items():
        t_s = _times(some, boot_s)
        kept, wrong = plausible(t_s)
        if wrong:
            damage.append(f"{wrong} messages {name} have an impossible time and were left out")
        rows = np.flatnonzero(kept)
        rows = rows[np.concatenate([[True], np.diff(t_s[rows]) > 0.0])] if len(rows) else rows
        if not len(rows):
            continue
        names = [f for f in some[0][1].get_fieldnames() if _number(getattr(some[0][1], f))]
        fields = {f: np.array([getattr(some[k][1], f) for k in rows.tolist()]) for f in names}
        found[name] = {0: Messages(t_s[rows], fields)}
    return found, parameters, texts


def _times(some: list[tuple[float, Any]], boot_s: float) -> Array:
    """Return times since boot: a message's own where it has one."""
    stamps = np.array([s for s, _ in some]) - boot_s
    first = some[0][1]
    if hasattr(first, "time_boot_ms"):
        return np.array([m.time_boot_ms for _, m in some]) * 1e-3
    if hasattr(first, "time_usec"):
        raw_us = np.array([m.time_usec for _, m in some], dtype=np.float64)
        if first.get_type() == "SERVO_OUTPUT_RAW":  # 32 bits
            raw_us = np.unwrap(raw_us, period=WRAP_US)
        if np.median(raw_us) * 1e-6 < OTHER_CLOCK_S:
            return np.asarray(raw_us * 1e-6)
    return np.asarray(stamps)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
