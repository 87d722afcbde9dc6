"""MAVLink telemetry logs in portions: pymavlink says how messages are laid out, numpy reads them.

A message's own time since boot counts where it has one; the radio's delay is then not in it. Others
are timed by the ground station, whose clock messages with both connect to the autopilot's. A sender
is a component of a system: what another component of the vehicle says is not the autopilot's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array, BoolArray, IntArray
from host.progress import progress_bar
from host.readers.autopilot_log import (
    AutopilotLog,
    Messages,
    NotAutopilotLogError,
    last_time_s,
)
from host.readers.clock_epochs import epoch_starts
from host.readers.mavlink_frames import Frames, frames_of
from host.readers.mavlink_layout import Layout, layouts
from host.readers.plausible_times import plausible_times
from host.readers.px4_tailsitter import MAV_TYPES
from host.readers.tlog_clock import (
    BOTH_CLOCKS,
    OTHER_CLOCK_S,
    PLACE,
    STAMP,
    Fields,
    Station,
    message_times,
    own_times,
)
from host.readers.ulog_messages import BY_MAV_TYPE
from host.readers.written_parameters import Parameters

AUTOPILOTS = {3: "ardupilot", 12: "px4"}
GROUND_STATION, NO_AUTOPILOT = 6, 8
REAL32 = 9  # MAV_PARAM_TYPE
PORTION_BYTES = 8 << 20  # read at a time


@dataclass(slots=True)
class _Received:
    """Received messages by kind and sender, in parts, with the losses of each sender."""

    parts: dict[tuple[int, str], list[Fields]] = field(default_factory=dict)
    frames: int = 0
    last_number: dict[int, int] = field(default_factory=dict)
    # By sender, portion by portion: its frames, and before which ones some are missing.
    many: dict[int, list[NDArray[np.uint32]]] = field(default_factory=dict)
    gaps: dict[int, list[IntArray]] = field(default_factory=dict)
    wrong_crc: int = 0
    strange_bytes: int = 0

    def senders(self) -> dict[int, int]:
        """Return how many wanted messages each sender sent."""
        found: dict[int, int] = {}
        for (sender, _), parts in self.parts.items():
            found[sender] = found.get(sender, 0) + sum(len(part[PLACE]) for part in parts)
        return found

    def take(self, sender: int, name: str) -> Fields | None:
        """Return all messages of a kind and free their memory: a log may have a gigabyte."""
        parts = self.parts.pop((sender, name), None)
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


def read_tlog(path: Path) -> list[AutopilotLog]:
    """Read a telemetry log: what each start of the autopilot sent.

    Raises
    ------
    NotAutopilotLogError
        If no vehicle speaks in it.
    ModuleNotFoundError
        If pymavlink is missing.
    """
    received = _received(path)
    many = received.senders()
    vehicles = {sender: _heartbeat(received, sender) for sender in many}
    known = {sender: beat for sender, beat in vehicles.items() if beat is not None}
    if not known:
        raise NotAutopilotLogError(
            f"{path}: no frame of a vehicle (HEARTBEAT) in it; expected a MAVLink telemetry log"
        )
    sender = max(known, key=lambda s: many[s])
    damage = _damage(received)
    systems = {one >> 8 for one in known}
    if len(systems) > 1:
        damage.append(f"{len(systems)} vehicles speak in it; system {sender >> 8} is read")
    remarks = _other_components(received, sender)
    tables = {
        name: received.take(sender, name) or {}
        for name in [name for one, name in received.parts if one == sender]
    }
    received.parts.clear()
    timed = [
        (fields[PLACE], own_s)
        for name, fields in tables.items()
        if (own_s := own_times(name, fields)) is not None
    ]
    starts = epoch_starts(timed)
    # A sender that starts again numbers its frames anew: what seems lost there was never sent.
    restarts = [(place, _first_place(timed, place)) for place in starts]
    del timed
    kind, autopilot = known[sender]
    lost = received.wrong_crc + (1 if received.strange_bytes else 0)
    logs = []
    written: list[tuple[list[tuple[str, float, float]], float]] = []
    for first, end in pairwise([0, *starts, received.frames]):
        own = {name: _between(fields, first, end) for name, fields in tables.items()}
        if len(starts) == 0:
            tables.clear()
        own_damage = damage + _lost(received, sender, first, end, restarts)
        own_remarks = list(remarks)
        texts = _words(own.pop("STATUSTEXT", {}).get("text", ()))
        said = own.pop("PARAM_VALUE", {})
        station = Station(own, own_remarks)
        messages = _messages(own, station, own_damage)
        written.append((_parameters(said, station, autopilot), last_time_s(messages)))
        logs.append(
            AutopilotLog(
                path=path,
                format="tlog",
                autopilot=AUTOPILOTS.get(autopilot, "ardupilot"),
                vehicle=_vehicle(kind, autopilot),
                firmware=next((t for t in texts if "ardu" in t.lower() or "px4" in t.lower()), ""),
                messages=messages,
                parameters={},
                damage=tuple(own_damage),
                lost=lost,
                texts=tuple(texts),
                remarks=tuple(own_remarks),
            )
        )
    return _with_parameters(logs, written)


def _with_parameters(
    logs: Sequence[AutopilotLog], written: Sequence[tuple[list[tuple[str, float, float]], float]]
) -> list[AutopilotLog]:
    """Return logs with their parameters, of each flight as said in it, and when it ended.

    A station asks for them once, whatever restarts behind its back: what a flight does not say is
    as it was before it, or as it was said first.
    """
    known = {name: value for own, _ in reversed(written) for name, value, _ in reversed(own)}
    found = []
    for log, (own, end_s) in zip(logs, written, strict=True):
        before = [(name, value, -np.inf) for name, value in known.items()]
        found.append(replace(log, parameters=Parameters([*before, *own], end_s)))
        known |= {name: value for name, value, _ in own}
    return found


def _first_place(timed: Sequence[tuple[IntArray, Array]], start: int) -> int:
    """Return the place of the first message with a time of its own, from a start on."""
    rows = [(places, int(np.searchsorted(places, start))) for places, _ in timed]
    return min((int(places[row]) for places, row in rows if row < len(places)), default=start)


def _parameters(said: Fields, station: Station, autopilot: int) -> list[tuple[str, float, float]]:
    """Return name, value and time of parameters as the autopilot said them.

    PX4 sends the bytes of an integer as those of a float, ArduPilot its value.
    """
    if not said:
        return []
    values = said["param_value"].astype(np.float64)
    if AUTOPILOTS.get(autopilot) == "px4":
        whole = np.ascontiguousarray(said["param_value"]).view("<i4")
        values = np.where(said["param_type"] == REAL32, values, whole)
    t_s = station.since_boot_s(np.asarray(said[STAMP], dtype=np.float64), said[PLACE])
    return list(zip(_words(said["param_id"]), values.tolist(), t_s.tolist(), strict=True))


def _between(fields: Fields, first: int, end: int) -> Fields:
    """Return the messages from one place of the log to another; views where these are all."""
    if PLACE not in fields:
        return fields
    low, high = np.searchsorted(fields[PLACE], [first, end])
    return {key: values[low:high] for key, values in fields.items()}


def _other_components(received: _Received, sender: int) -> list[str]:
    """Return a line on messages that another component of the vehicle sends too."""
    own = {name for one, name in received.parts if one == sender} - {"HEARTBEAT"}
    found = []
    for one in sorted({one for one, _ in received.parts if one >> 8 == sender >> 8} - {sender}):
        both = sorted(name for other, name in received.parts if other == one and name in own)
        if both:
            found.append(
                f"component {one & 255} of the vehicle sends {', '.join(both)} too: left out, that"
                f" of component {sender & 255} is used"
            )
    return found


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
        places = (np.flatnonzero(frames.senders == sender) + found.frames).astype(np.uint32)
        found.many.setdefault(sender, []).append(places)
        gaps = np.flatnonzero(missed)
        found.gaps.setdefault(sender, []).append(np.stack([places[gaps], missed[gaps]]))
        found.last_number[sender] = int(numbers[-1])
    view = np.frombuffer(data, dtype=np.uint8)
    for number, layout in known.items():
        of_kind = frames.kinds == number
        for sender in np.unique(frames.senders[of_kind]).tolist():
            rows = np.flatnonzero(of_kind & (frames.senders == sender))
            part = _fields(view, frames, rows, layout)
            part[PLACE] = (rows + found.frames).astype(np.uint32)
            found.parts.setdefault((sender, layout.name), []).append(part)
    found.frames += len(frames.starts)


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


def _heartbeat(received: _Received, sender: int) -> tuple[int, int] | None:
    """Return kind of vehicle and of autopilot from a sender's heartbeat; None for other senders."""
    parts = received.parts.get((sender, "HEARTBEAT"), [])
    beats = [
        (int(kind), int(autopilot))
        for part in parts
        for kind, autopilot in zip(part["type"], part["autopilot"], strict=True)
        if kind != GROUND_STATION and autopilot != NO_AUTOPILOT
    ]
    return beats[len(beats) // 2] if beats else None


def _vehicle(kind: int, autopilot: int) -> str:
    if AUTOPILOTS.get(autopilot) == "px4" and kind in MAV_TYPES:
        return "tailsitter"
    return BY_MAV_TYPE.get(kind, "")


def _damage(received: _Received) -> list[str]:
    said = []
    if received.wrong_crc:
        said.append(f"{received.wrong_crc} frames have a wrong checksum and were left out")
    if received.strange_bytes:
        said.append(f"{received.strange_bytes} bytes belong to no frame")
    return said


def _lost(
    received: _Received, sender: int, first: int, end: int, restarts: Sequence[tuple[int, int]]
) -> list[str]:
    """Return a line on frames of the vehicle that never came, between two places of the log."""
    places, missed = np.concatenate(received.gaps[sender], axis=1)
    counts = (places >= first) & (places < end)
    for start, timed in restarts:
        counts &= (places < start) | (places > timed)
    lost = int(missed[counts].sum())
    total = sum(int(np.sum((many >= first) & (many < end))) for many in received.many[sender])
    if not lost:
        return []
    share = 100.0 * lost / (lost + total)
    return [f"{lost} frames ({share:.1f} %) of the vehicle never came: the radio lost them"]


def _words(raw: Any) -> list[str]:
    return [bytes(one).decode("ascii", "replace").strip("\0") for one in raw]


def _messages(
    tables: dict[str, Fields], station: Station, damage: list[str]
) -> dict[str, dict[int, Messages]]:
    found: dict[str, dict[int, Messages]] = {}
    for name in list(tables):
        fields = dict(tables.pop(name))
        t_s = message_times(name, fields, station)
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
