"""MAVLink telemetry logs in portions: pymavlink says how messages are laid out, numpy reads them.

A message's own time since boot counts where it has one; the radio's delay is then not in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array, BoolArray
from host.progress import progress_bar
from host.readers.autopilot_log import AutopilotLog, Messages, NotAutopilotLogError
from host.readers.mavlink_frames import Frames, frames_of
from host.readers.mavlink_layout import Layout, layouts
from host.readers.plausible_times import plausible_times
from host.readers.ulog_messages import BY_MAV_TYPE

AUTOPILOTS = {3: "ardupilot", 12: "px4"}
GROUND_STATION, NO_AUTOPILOT = 6, 8
WRAP_US = float(1 << 32)
OTHER_CLOCK_S = 1e9  # a time since boot is shorter than thirty years
PORTION_BYTES = 8 << 20  # read at a time
STAMP = "received_s"  # of the ground station, beside a message's own fields
BOTH_CLOCKS = "ATTITUDE"  # has both clocks, so it dates the autopilot's start
Fields = dict[str, NDArray[Any]]


@dataclass(slots=True)
class _Received:
    """Received messages by kind and system, in parts, with the losses of each sender."""

    parts: dict[tuple[int, str], list[Fields]] = field(default_factory=dict)
    started_s: dict[int, list[Array]] = field(default_factory=dict)
    last_number: dict[int, int] = field(default_factory=dict)
    lost: dict[int, int] = field(default_factory=dict)
    many: dict[int, int] = field(default_factory=dict)
    wrong_crc: int = 0
    strange_bytes: int = 0

    def systems(self) -> dict[int, int]:
        """Return how many wanted messages each system sent."""
        found: dict[int, int] = {}
        for (system, _), parts in self.parts.items():
            found[system] = found.get(system, 0) + sum(len(next(iter(p.values()))) for p in parts)
        return found

    def take(self, system: int, name: str) -> Fields | None:
        """Return all messages of a kind and free their memory: a log may have a gigabyte."""
        parts = self.parts.pop((system, name), None)
        if parts is None:
            return None
        found = {}
        sizes = [len(next(iter(part.values()))) for part in parts]
        for key in dict.fromkeys(key for part in parts for key in part):
            if key == STAMP and not all(key in part for part in parts):
                continue
            kind = next(part[key].dtype for part in parts if key in part)
            found[key] = np.concatenate(
                [part.pop(key, np.zeros(n, kind)) for part, n in zip(parts, sizes, strict=True)]
            )
        return found


def read_tlog(path: Path) -> AutopilotLog:
    """Read a telemetry log.

    Raises
    ------
    NotAutopilotLogError
        If no vehicle speaks in it.
    ModuleNotFoundError
        If pymavlink is missing.
    """
    received = _received(path)
    many = received.systems()
    vehicles = {system: _heartbeat(received, system) for system in many}
    known = {system: beat for system, beat in vehicles.items() if beat is not None}
    if not known:
        raise NotAutopilotLogError(
            f"{path}: no frame of a vehicle (HEARTBEAT) in it; expected a MAVLink telemetry log"
        )
    system = max(known, key=lambda s: many[s])
    damage = _damage(received, system)
    if len(known) > 1:
        damage.append(f"{len(known)} vehicles speak in it; system {system} is read")
    kind, autopilot = known[system]
    texts = _words((received.take(system, "STATUSTEXT") or {}).get("text", ()))
    values = received.take(system, "PARAM_VALUE") or {}
    parameters = dict(
        zip(_words(values.get("param_id", ())), map(float, values.get("param_value", ())),
            strict=True)
    )  # fmt: skip
    return AutopilotLog(
        path=path,
        format="tlog",
        autopilot=AUTOPILOTS.get(autopilot, "ardupilot"),
        vehicle=BY_MAV_TYPE.get(kind, ""),
        firmware=next((t for t in texts if "ardu" in t.lower() or "px4" in t.lower()), ""),
        messages=_messages(received, system, damage),
        parameters=parameters,
        damage=tuple(damage),
        lost=received.wrong_crc + (1 if received.strange_bytes else 0),
        texts=tuple(texts),
    )


def _received(path: Path) -> _Received:
    """Read every wanted message."""
    known = layouts()
    extras = {number: layout.extra for number, layout in known.items()}
    size = path.stat().st_size
    progress = progress_bar("reading", size)
    found, data, done = _Received(), b"", 0
    with path.open("rb") as file:
        while more := file.read(PORTION_BYTES):
            data += more
            done += len(more)
            frames = frames_of(data, extras)
            _add(found, data, frames, known)
            data = data[frames.rest :]
            if progress is not None:
                progress(done, size)
    found.strange_bytes += len(data)
    return found


def _add(found: _Received, data: bytes, frames: Frames, known: Mapping[int, Layout]) -> None:
    """Add the frames of a portion."""
    found.wrong_crc += frames.wrong_crc
    found.strange_bytes += frames.strange_bytes
    for sender in np.unique(frames.senders).tolist():
        numbers = frames.numbers[frames.senders == sender].astype(np.int64)
        before = found.last_number.get(sender, int(numbers[0]) - 1)
        missed = (np.diff(numbers, prepend=before) - 1) % 256
        found.lost[sender] = found.lost.get(sender, 0) + int(missed.sum())
        found.many[sender] = found.many.get(sender, 0) + len(numbers)
        found.last_number[sender] = int(numbers[-1])
    view = np.frombuffer(data, dtype=np.uint8)
    systems = frames.senders >> 8
    for number, layout in known.items():
        of_kind = frames.kinds == number
        for system in np.unique(systems[of_kind]).tolist():
            rows = np.flatnonzero(of_kind & (systems == system))
            part = _fields(view, frames, rows, layout)
            if layout.name == BOTH_CLOCKS:
                started = part.pop(STAMP) - part["time_boot_ms"] * 1e-3
                begins = found.started_s.setdefault(system, [started[:1]])
                begins.append((started - begins[0]).astype(np.float32))  # jitter of the radio
            found.parts.setdefault((system, layout.name), []).append(part)


def _fields(
    view: NDArray[np.uint8], frames: Frames, rows: NDArray[np.intp], layout: Layout
) -> Fields:
    """Return the wanted fields of messages of a kind, and when they were received."""
    places = np.arange(layout.payload.itemsize)
    at = frames.body_at[rows, None] + places
    sent = places < frames.body_bytes[rows, None]  # MAVLink 2 leaves zeros at the end out
    body = np.where(sent, view[np.minimum(at, len(view) - 1)], np.uint8(0))
    table = np.ascontiguousarray(body).view(layout.payload)[:, 0]
    # Most outputs have no pulse; a message with its own clock needs no time of reception.
    part = {name: table[name].copy() for name in layout.fields
            if not name.startswith("servo") or table[name].any()}  # fmt: skip
    if "time_usec" in part and np.median(part["time_usec"]) * 1e-6 < OTHER_CLOCK_S:
        return part
    if "time_boot_ms" in part and layout.name != BOTH_CLOCKS:
        return part
    stamps = np.ascontiguousarray(view[frames.starts[rows, None] + np.arange(8)]).view(">u8")
    part[STAMP] = stamps[:, 0].astype(np.float64) * 1e-6
    return part


def _heartbeat(received: _Received, system: int) -> tuple[int, int] | None:
    """Return kind of vehicle and of autopilot from a system's heartbeat; None for other systems."""
    parts = received.parts.get((system, "HEARTBEAT"), [])
    beats = [
        (int(kind), int(autopilot))
        for part in parts
        for kind, autopilot in zip(part["type"], part["autopilot"], strict=True)
        if kind != GROUND_STATION and autopilot != NO_AUTOPILOT
    ]
    return beats[len(beats) // 2] if beats else None


def _damage(received: _Received, system: int) -> list[str]:
    said = []
    if received.wrong_crc:
        said.append(f"{received.wrong_crc} frames have a wrong checksum and were left out")
    if received.strange_bytes:
        said.append(f"{received.strange_bytes} bytes belong to no frame")
    senders = [sender for sender in received.many if sender >> 8 == system]
    lost = sum(received.lost[sender] for sender in senders)
    total = sum(received.many[sender] for sender in senders)
    if lost:
        share = 100.0 * lost / (lost + total)
        said.append(f"{lost} frames ({share:.1f} %) of the vehicle never came: the radio lost them")
    return said


def _words(raw: Any) -> list[str]:
    return [bytes(one).decode("ascii", "replace").strip("\0") for one in raw]


def _messages(
    received: _Received, system: int, damage: list[str]
) -> dict[str, dict[int, Messages]]:
    boot_s = _boot_s(received, system)
    found: dict[str, dict[int, Messages]] = {}
    for name in [name for one, name in received.parts if one == system]:
        fields = received.take(system, name) or {}
        t_s = _times(name, fields, boot_s)
        ports = fields.pop("port", None)
        for port in (0,) if ports is None else np.unique(ports).tolist():
            mine = slice(None) if ports is None or len(np.unique(ports)) == 1 else ports == port
            own_s = t_s[mine]
            kept, wrong = plausible_times(own_s)
            if wrong:
                damage.append(f"{wrong} messages {name} have an impossible time and were left out")
            rows = _increasing_rows(own_s, kept)
            if rows is None:
                continue
            own = {k: v[mine][rows] for k, v in fields.items()}
            if ports is not None:  # outputs without a pulse are half of them
                own = {k: v for k, v in own.items() if v.any()}
            found.setdefault(name, {})[int(port)] = Messages(own_s[rows], own)
    return found


def _increasing_rows(t_s: Array, kept: BoolArray) -> Any:
    """Return the rows kept and later than the one before: all as a slice, a view; None if none."""
    if kept.all() and (np.diff(t_s) > 0.0).all():
        return slice(None) if len(t_s) else None
    rows = np.flatnonzero(kept)
    if not len(rows):
        return None
    return rows[np.concatenate([[True], np.diff(t_s[rows]) > 0.0])]


def _boot_s(received: _Received, system: int) -> float:
    """Return the ground station's time at which the autopilot started."""
    if started := received.started_s.pop(system, None):
        return float(started[0][0] + np.median(np.concatenate(started[1:])))
    every = [part[STAMP] for (one, _), some in received.parts.items() if one == system
             for part in some if STAMP in part]  # fmt: skip
    return float(min(stamps.min() for stamps in every)) if every else 0.0


def _times(name: str, fields: Fields, boot_s: float) -> Array:
    """Return times since boot: a message's own where it has one."""
    if "time_boot_ms" in fields:
        return np.asarray(fields.pop("time_boot_ms") * 1e-3, dtype=np.float64)
    raw_us, stamps = fields.pop("time_usec", None), fields.pop(STAMP, None)
    if stamps is not None:
        return np.asarray(stamps - boot_s)
    own_us = np.asarray(raw_us, dtype=np.float64)
    if name == "SERVO_OUTPUT_RAW":  # 32 bits
        own_us = np.unwrap(own_us, period=WRAP_US)
    return own_us * 1e-6
