"""Which messages and fields of a telemetry log are read, and their layout as pymavlink knows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

_IMU = ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")
_SERVOS = tuple(f"servo{k}_raw" for k in range(1, 17))
WANTED: dict[str, tuple[str, ...]] = {
    "HEARTBEAT": ("type", "autopilot"),
    "ATTITUDE": ("time_boot_ms", "roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed"),
    "RAW_IMU": ("time_usec", *_IMU), "SCALED_IMU": ("time_boot_ms", *_IMU),
    "SCALED_IMU2": ("time_boot_ms", *_IMU), "HIGHRES_IMU": ("time_usec", *_IMU),
    "SERVO_OUTPUT_RAW": ("time_usec", "port", *_SERVOS), "VFR_HUD": ("airspeed",),
    "SCALED_PRESSURE": ("time_boot_ms", "press_abs", "press_diff", "temperature"),
    "GLOBAL_POSITION_INT": ("time_boot_ms", "vx", "vy", "vz"),
    "PARAM_VALUE": ("param_id", "param_value", "param_type"), "STATUSTEXT": ("text",),
}  # fmt: skip
_TYPES = {
    "char": "S", "uint8_t": "u1", "int8_t": "i1", "uint16_t": "<u2", "int16_t": "<i2",
    "uint32_t": "<u4", "int32_t": "<i4", "uint64_t": "<u8", "int64_t": "<i8", "float": "<f4",
    "double": "<f8",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Layout:
    """One kind of message: name, layout of its payload, what its checksum counts besides."""

    name: str
    payload: np.dtype[np.void]
    extra: int

    @property
    def fields(self) -> tuple[str, ...]:
        """Return the fields that are read."""
        return WANTED[self.name]


def layouts() -> dict[int, Layout]:
    """Return the wanted kinds by their number.

    Raises
    ------
    ModuleNotFoundError
        If pymavlink is missing.
    """
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    found = {}
    for name in WANTED:
        number = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
        message = dialect.mavlink_map[number]
        found[number] = Layout(name, _payload(message), message.crc_extra)
    return found


def _payload(message: Any) -> np.dtype[np.void]:
    kinds = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    parts: list[tuple[str, Any] | tuple[str, Any, tuple[int, ...]]] = []
    for name, many in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
        kind = _TYPES[kinds[name]]
        if kind == "S":
            parts.append((name, f"S{max(many, 1)}"))
        else:
            parts.append((name, kind, (many,)) if many else (name, kind))
    return np.dtype(parts)
