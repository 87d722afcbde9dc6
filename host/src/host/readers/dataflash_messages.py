"""ArduPilot DataFlash, binary or text, as messages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array, IntArray
from host.progress import progress_bar
from host.readers.autopilot_log import (
    AutopilotLog,
    Messages,
    NotAutopilotLogError,
    last_time_s,
)
from host.readers.clock_epochs import clock_origin_s, epoch_starts
from host.readers.dataflash_binary import read_records
from host.readers.dataflash_text import read_text_records
from host.readers.plausible_times import plausible_times
from host.readers.written_parameters import Parameters

# What is read of a log, and which fields of it (of outputs all).
_INERTIAL = ("TimeUS", "TimeMS", "I", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ")
_AIRSPEED = ("TimeUS", "TimeMS", "I", "Airspeed", "Temp", "H", "Health", "U", "Pri")
_BARO = ("TimeUS", "TimeMS", "I", "Alt", "Press", "GndTemp")
_GPS = ("TimeUS", "TimeMS", "T", "I", "Status", "Spd", "GCrs", "VZ")
WANTED: dict[str, tuple[str, ...]] = {
    "IMU": _INERTIAL, "IMU2": _INERTIAL, "IMU3": _INERTIAL,
    "ATT": ("TimeUS", "TimeMS", "Roll", "Pitch", "Yaw"),
    "ARSP": _AIRSPEED, "ASP2": _AIRSPEED, "BARO": _BARO, "BAR2": _BARO, "GPS": _GPS, "GPS2": _GPS,
    "RCOU": (), "RCO2": (), "RCO3": (), "PARM": ("TimeUS", "TimeMS", "Name", "Value"),
    "MSG": ("TimeUS", "TimeMS", "Message"), "VER": ("TimeUS", "FWS"), "VIBE": (), "DSF": ("Dp",),
    "MODE": ("TimeUS", "TimeMS", "ModeNum"), "SIDD": ("TimeUS",), "ATRP": ("TimeUS",),
}  # fmt: skip
TEXTS = {("PARM", "Name"), ("MSG", "Message"), ("VER", "FWS")}
# Fields with the time; the first that a kind has counts. Old releases write the GPS week's time as
# TimeMS of a GPS record, and their own clock as its T.
STAMPS = {"TimeUS": 1e-6, "T": 1e-3, "TimeMS": 1e-3}
# The field that numbers the instances of a kind, in the releases that have one.
INSTANCE = {"IMU": "I", "ARSP": "I", "BARO": "I", "GPS": "I", "VIBE": "IMU", "XKF1": "C"}
NUMBERED = {"ASP2": ("ARSP", 1), "BAR2": ("BARO", 1)}  # old names of second sensors
VEHICLES = (
    ("plane", "plane"), ("copter", "copter"), ("rover", "rover"), ("sub", "submarine"),
    ("antennatracker", "antenna tracker"), ("blimp", "blimp"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Table:
    """Records of one definition: name, number (0 in text), places in the log, fields."""

    name: str
    number: int
    places: IntArray
    fields: Mapping[str, NDArray[Any]]

    def __len__(self) -> int:
        return len(self.places)

    def times(self) -> Array | None:
        """Return the time of each, s; None where it has none."""
        for stamp, unit_s in STAMPS.items():
            if stamp in self.fields:
                return np.asarray(self.fields[stamp] * unit_s, dtype=np.float64)
        return None

    def between(self, first: int, end: int) -> _Table:
        """Return the records from one place of the log to another; itself if these are all."""
        low, high = np.searchsorted(self.places, [first, end])
        if high - low == len(self):
            return self
        rows = slice(low, high)
        fields = {key: values[rows] for key, values in self.fields.items()}
        return _Table(self.name, self.number, self.places[rows], fields)


def read_dataflash(path: Path, *, text: bool) -> list[AutopilotLog]:
    """Read a DataFlash log: what each start of the autopilot wrote into it.

    Parameters
    ----------
    path : Path
    text : bool
        Whether it is the text form (``.log``).

    Raises
    ------
    NotAutopilotLogError
        If it holds no record.
    """
    damage: list[str] = []
    remarks: list[str] = []
    found, lost = _text(path, damage, remarks) if text else _binary(path, damage)
    if not any(len(table) for table in found):
        raise NotAutopilotLogError(
            f"{path}: begins as a DataFlash log but holds no whole record; is it cut?"
        )
    timed = [(table.places, t) for table in found if (t := table.times()) is not None]
    ends = [0, *epoch_starts(timed), np.iinfo(np.int64).max]
    form = "dataflash-text" if text else "dataflash"
    if len(ends) == 2:
        return [_log(path, form, found, damage, lost, remarks)]
    return [
        _log(
            path, form, [table.between(a, b) for table in found], list(damage), lost, list(remarks)
        )
        for a, b in pairwise(ends)
    ]


def _log(
    path: Path,
    form: str,
    found: Sequence[_Table],
    damage: list[str],
    lost: int,
    remarks: list[str],
) -> AutopilotLog:
    """Return what one start of the autopilot wrote."""
    tables = _defined_once(found, remarks)
    every = [t for table in tables.values() if (t := table.times()) is not None]
    origin_s = clock_origin_s(every)
    messages: dict[str, dict[int, Messages]] = {}
    for table in tables.values():
        _add(messages, table, origin_s, damage)
    fields = {name: table.fields for name, table in tables.items()}
    texts = _texts(fields)
    firmware = next((line for line in texts if _vehicle(line)), "")
    dropped = fields.get("DSF", {}).get("Dp")
    if dropped is not None and len(dropped) and int(np.max(dropped)) > 0:
        damage.append(f"the autopilot dropped {int(np.max(dropped))} records itself (DSF.Dp)")
    return AutopilotLog(
        path=path,
        format=form,
        autopilot="ardupilot",
        vehicle=_vehicle(firmware),
        firmware=firmware,
        messages=messages,
        parameters=_parameters(tables.get("PARM"), origin_s, last_time_s(messages)),
        damage=tuple(damage),
        lost=lost,
        texts=tuple(texts),
        remarks=tuple(remarks),
    )


def _defined_once(found: Sequence[_Table], remarks: list[str]) -> dict[str, _Table]:
    """Return tables by name: of two definitions of a name that of the autopilot, with most records.

    A script may log a kind of its own under a name that the autopilot has.
    """
    tables: dict[str, _Table] = {}
    for table in found:
        other = tables.get(table.name)
        if other is None or not len(other):
            tables[table.name] = table
        elif len(table):
            used, left = sorted((other, table), key=len, reverse=True)
            tables[table.name] = used
            remarks.append(
                f"{table.name} is defined twice: the {len(used)} records of number {used.number}"
                f" are used, {len(left)} of number {left.number} are left out"
            )
    return tables


def _of_their_kind(name: str, fields: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return the fields that are what they are read as: a log's own FMT may say otherwise."""
    return {
        column: values
        for column, values in fields.items()
        if values.ndim == 1 and (values.dtype.kind in "fiub") != ((name, column) in TEXTS)
    }


def _binary(path: Path, damage: list[str]) -> tuple[list[_Table], int]:
    found = read_records(path, progress_bar("reading", path.stat().st_size))
    tables = []
    for number, kind in found.kinds.items():
        places = found.places.pop(number)  # of a large log too large to be kept
        if kind.name in WANTED and len(places):
            rows = found.rows(kind, places, WANTED[kind.name])
            tables.append(_Table(kind.name, number, places, _of_their_kind(kind.name, rows)))
    if found.lost:
        at, size = found.lost[0]
        total = sum(size for _, size in found.lost)
        damage.append(
            f"{total} bytes in {len(found.lost)} ranges are no proven record, the first {size} at"
            f" byte {at}: the format has no checksum, a value changed elsewhere is not seen"
        )
    return tables, len(found.lost)


def _text(path: Path, damage: list[str], remarks: list[str]) -> tuple[list[_Table], int]:
    found = read_text_records(path, WANTED)
    if found.bad_lines:
        damage.append(f"{found.bad_lines} lines are no records and were left out")
    remarks += [f"{name} is defined twice: the first definition counts" for name in found.twice[:5]]
    tables = [
        _Table(name, 0, found.lines[name], _of_their_kind(name, fields))
        for name, fields in found.tables.items()
    ]
    return tables, found.bad_lines


def _add(
    messages: dict[str, dict[int, Messages]], table: _Table, origin_s: float, damage: list[str]
) -> None:
    """Add the records of a kind, each instance of its own."""
    name, fields, t_s = table.name, table.fields, table.times()
    if t_s is None:
        return
    t_s -= origin_s
    base = re.fullmatch(r"([A-Z]+?)([23])", name)
    called, number = NUMBERED.get(name, (name, 0))
    if base and base[1] in INSTANCE:
        called, number = base[1], int(base[2]) - 1
    which = fields.get(INSTANCE.get(called, ""))
    instances = [number] if which is None else sorted(set(np.unique(which).tolist()))
    for one in instances:
        single = which is None or len(instances) == 1
        mine = np.arange(len(t_s)) if single else np.flatnonzero(which == one)
        kept, wrong = plausible_times(t_s if single else t_s[mine])
        if wrong:
            damage.append(f"{wrong} records of {called} have an impossible time and were left out")
        if kept.any():
            whole = single and not wrong  # then nothing is copied: a log may have a gigabyte
            rows = slice(None) if whole else mine[kept]
            # Outputs without a pulse are most of RCOU.
            own = {
                key: values[rows]
                for key, values in fields.items()
                if key not in STAMPS and (not called.startswith("RCO") or values.any())
            }
            messages.setdefault(called, {})[int(one)] = Messages(t_s[rows], own)


def _texts(tables: Mapping[str, Mapping[str, NDArray[Any]]]) -> list[str]:
    said = [_word(v) for v in tables.get("MSG", {}).get("Message", ())]
    return [_word(v) for v in tables.get("VER", {}).get("FWS", ())] + said


def _word(value: object) -> str:
    raw = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return raw.strip("\0 ")


def _vehicle(line: str) -> str:
    first = line.lower().replace(" ", "")
    for word, kind in VEHICLES:
        if first.startswith(("ardu" + word, word)):
            return kind
    return ""


def _parameters(table: _Table | None, origin_s: float, end_s: float) -> Parameters:
    """Return the parameters; what has no time within the log was written before."""
    if table is None or not {"Name", "Value"} <= table.fields.keys():
        return Parameters()
    t_s = table.times()
    if t_s is None:
        t_s = np.zeros(len(table))
    t_s = t_s - origin_s
    times = np.where((t_s > 0.0) & (t_s <= end_s), t_s, 0.0).tolist()
    names, values = map(_word, table.fields["Name"]), map(float, table.fields["Value"])
    return Parameters(zip(names, values, times, strict=True), end_s)
