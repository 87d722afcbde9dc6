"""Any source that `host decode` reads -> a flight to be shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from host.arrays import Array
from host.decode.decoding import finite, pick
from host.decode.log_summary import summarise
from host.decode.summary_text import lines
from host.errors import HostError, IdentificationError, NotALogError, UsageError
from host.log import FlightLog, read_log
from host.log.source import check_source
from host.original.row_summary import row_lines, summarise_rows
from host.original.row_table import make_table
from host.original.rows import looks_like_rows, read_rows
from host.physical.calibration import load_calibration
from host.physical.columns import COLUMNS, UNITS
from host.progress import progress_bar
from host.readers.autopilot_flight import is_autopilot_log, read_autopilot
from host.readers.autopilot_summary import autopilot_meta, summarise_autopilot, summary_lines
from host.readers.even_grid import FITTED, even_arrays
from host.readers.flight_choice import with_flight
from host.readers.readable_file import readable_file
from host.report.gps_position import (
    calibration_values,
    changed_position,
    log_position,
    log_utc_s,
)
from host.report.shown_flight import Happening, ServoJump, ShownFlight, with_gaps
from host.sysid.flight import read_columns, read_flight_columns
from host.sysid.maneuvers import DetectedManeuver, Grade, detect_maneuvers, grade
from host.text import shown

TABLES = (".csv", ".parquet", ".mat")
_HEAD_BYTES = 4096
_TEXTS = {column.name: column.text for column in COLUMNS}
# Events whose number is a word (protocol/frames.toml).
_ARGUMENTS = {
    "session_start": "start_cause", "session_end": "end_cause", "reset": "reset_cause",
    "drive_changed": "drive",
}  # fmt: skip
Maneuvers = list[tuple[DetectedManeuver, Grade]]


@dataclass(frozen=True, slots=True)
class FlightRequest:
    """What to read; see ``host plot --help``."""

    source: Path
    session: int | None = None
    file_id: int | None = None
    calibration: Path | None = None
    row_rate_hz: float | None = None
    sensors: tuple[tuple[str, int | str], ...] = ()
    mapping: Path | None = None  # foreign names, units and signs of a table
    maneuvers: bool = True  # whether test points are looked for


def read_flight(wanted: FlightRequest) -> tuple[ShownFlight, Path]:
    """Read a flight with its maneuvers, events and losses; return the file it stood in too.

    Raises
    ------
    UsageError, NotALogError, LogError, CalibrationError
        See `host.decode.decoding.decode`.
    """
    path = readable_file(pick(check_source(wanted.source)))
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    kind = path.suffix.lower()
    if wanted.mapping is not None or (kind in TABLES and not looks_like_rows(head)):
        _refuse(wanted, path, "a table", ("file-id", "row-rate", "calibration", "sensor"))
        return _of_table(wanted, path), path
    if looks_like_rows(head):
        _refuse(wanted, path, "original ASCII rows", ("flight", "file-id", "sensor"))
        return _of_rows(wanted, path), path
    if is_autopilot_log(path):
        _refuse(wanted, path, "a log of an autopilot",
                ("file-id", "row-rate", "calibration"))  # fmt: skip
        return _of_autopilot(wanted, path), path
    _refuse(wanted, path, "a log of ours", ("row-rate", "sensor"))
    return _of_log(wanted, path), path


def _refuse(wanted: FlightRequest, path: Path, kind: str, options: tuple[str, ...]) -> None:
    given = {
        "flight": wanted.session, "file-id": wanted.file_id, "row-rate": wanted.row_rate_hz,
        "calibration": wanted.calibration, "sensor": wanted.sensors or None,
    }  # fmt: skip
    for option in options:
        if given[option] is not None:
            raise UsageError(f"{path}: {kind} has no --{option}; leave it out")


def _of_log(wanted: FlightRequest, path: Path) -> ShownFlight:
    log = read_log(
        path,
        session=wanted.session,
        file_id=wanted.file_id,
        calibration=wanted.calibration,
        progress=progress_bar("reading", path.stat().st_size),
    )
    return shown_log(log, test_points=wanted.maneuvers)


def shown_log(log: FlightLog, *, test_points: bool = True) -> ShownFlight:
    """Return one of our logs as a flight to be shown, its test points found where wanted.

    Raises
    ------
    NotALogError
        If it has no identification frame.
    """
    summary = finite(summarise(log))
    columns = log.columns()
    if not len(columns["t_s"]):
        raise NotALogError(
            f"{log.path}: no identification frame in this log; host info says what is"
        )
    maneuvers, notes = _maneuvers(columns) if test_points else ([], [])
    return ShownFlight(
        name=shown(log.path.name),
        columns=with_gaps(columns),
        units=UNITS,
        texts=_TEXTS,
        lines=list(lines(summary)),
        summary=summary,
        maneuvers=maneuvers,
        events=log_events(log),
        losses=_losses(summary),
        jumps=_jumps(summary),
        notes=notes,
        position=log_position(log),
        utc_s=log_utc_s(log),
        calibration=calibration_values(log.calibration),
        calibration_text=log.calibration.text,
    )


def log_events(log: FlightLog) -> list[Happening]:
    """Return the recorder's events, in the time of the table."""
    found = []
    for session in log.sessions:
        data, t_us = session.slow("event")
        for row, t_s in zip(data, session.seconds(t_us), strict=True):
            word = log.schema.word("event", int(row["code"]))
            text = shown(f"{word}: {_argument(log, word, int(row['arg']))}".replace("_", " "))
            found.append(Happening(float(t_s), text, float(t_s)))
    return sorted(found, key=lambda one: one.t_s)


def _argument(log: FlightLog, word: str, number: int) -> str:
    table = _ARGUMENTS.get(word)
    return log.schema.word(table, number) if table and table in log.schema.enums else str(number)


def _of_rows(wanted: FlightRequest, path: Path) -> ShownFlight:
    calibration = load_calibration(wanted.calibration)
    rows = read_rows(path)
    table = make_table(rows, calibration, wanted.row_rate_hz)
    if not table.rate.known:
        raise UsageError(f"{path}: the rate of its rows is {table.rate.text}")
    summary = finite(summarise_rows(path, rows, table, calibration))
    maneuvers, notes = _found_in(path, wanted) if wanted.maneuvers else ([], [])
    return ShownFlight(
        name=shown(path.name),
        columns=with_gaps(table.columns),
        units=UNITS,
        texts=_TEXTS,
        lines=row_lines(summary),
        summary=summary,
        maneuvers=maneuvers,
        losses=_losses(summary),
        notes=notes,
        position=changed_position(table.columns),
        calibration=calibration_values(calibration),
        calibration_text=calibration.text,
    )


def _of_table(wanted: FlightRequest, path: Path) -> ShownFlight:
    found = read_flight_columns(with_flight(path, wanted.session), wanted.mapping)
    columns = found.columns
    summary = {
        "format": "table",
        "complete": "as it was given",
        "duration_s": float(columns["t_s"][-1] - columns["t_s"][0]),
        "rows": len(columns["t_s"]),
        "losses": {"ranges": [], "ending": ""},
    }
    notes = [*found.notes, *(finding.line for finding in found.findings)]
    maneuvers, why = _maneuvers(columns) if wanted.maneuvers else ([], [])
    return ShownFlight(
        name=shown(path.name),
        columns=with_gaps(columns),
        units={name: UNITS.get(name, "") for name in columns},
        texts=_TEXTS,
        lines=list(map(shown, notes)),
        summary=summary,
        maneuvers=maneuvers,
        shares=found.shares,
        notes=[*map(shown, notes), *why],
        position=changed_position(columns),
    )


def _of_autopilot(wanted: FlightRequest, path: Path) -> ShownFlight:
    flight = read_autopilot(path, dict(wanted.sensors), wanted.session)
    summary = finite(summarise_autopilot(flight))
    columns = flight.columns()
    if not columns:
        raise NotALogError(f"{path}: none of the channels we know is in this log")
    meta = autopilot_meta(summary)
    notes: list[str] = []
    maneuvers: Maneuvers = []
    if flight.judgement.refusal:
        notes.append(_no_maneuvers(flight.judgement.refusal, path))
    elif wanted.maneuvers:
        maneuvers, notes = _found_in(path, wanted)
    return ShownFlight(
        name=shown(path.name),
        columns=_common_rows(columns),
        units=meta.units,
        texts=meta.texts,
        lines=summary_lines(summary),
        summary=summary,
        maneuvers=maneuvers,
        shares=flight.shares,
        notes=notes + [f"said by the autopilot: {text}" for text in flight.log.texts],
        position=changed_position(columns),
    )


def _common_rows(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return an autopilot's channels on the instants of the union, drawn between their samples.

    A channel has a value at its own instants only; beyond 1.5 of its own intervals there is a gap.
    """
    t_s = columns["t_s"]
    out: dict[str, Array] = {"t_s": t_s}
    for name, values in columns.items():
        seen = np.flatnonzero(np.isfinite(values))
        if name == "t_s" or not len(seen):
            continue
        own = t_s[seen]
        interpolated = np.interp(t_s, own, values[seen], left=np.nan, right=np.nan)
        steps = np.diff(own)
        usual = float(np.median(steps)) if len(steps) else 0.0
        after = np.clip(np.searchsorted(own, t_s), 1, max(1, len(own) - 1))
        if len(own) > 1:
            between = (t_s > own[after - 1]) & (t_s < own[after])
            interpolated[between & (own[after] - own[after - 1] > max(3.0 * usual, 0.25))] = np.nan
        out[name] = interpolated
    return out


def _found_in(path: Path, wanted: FlightRequest) -> tuple[Maneuvers, list[str]]:
    """Return the test points of a source whose sensors are slow, and drop out.

    A column that stands still counts as missing there, as in `host maneuvers`.
    """
    try:
        source = with_flight(path, wanted.session)
        found, _ = read_columns(
            source,
            calibration=wanted.calibration,
            sensors=dict(wanted.sensors),
            row_rate_hz=wanted.row_rate_hz,
        )
        return [(item, grade(found, item)) for item in detect_maneuvers(found)], []
    except HostError as error:
        return [], [_no_maneuvers(str(error), path)]


def _no_maneuvers(why: str, path: Path) -> str:
    """Return why no maneuvers were found, without the folder's name, as a page is mailed."""
    return f"no maneuvers: {shown(why.removeprefix(f'{path}: '))}"


def _maneuvers(columns: Mapping[str, Any]) -> tuple[Maneuvers, list[str]]:
    """Return the test points as `host maneuvers` finds them, or why there are none."""
    try:
        # What the finder looks at, and what divides a maneuver where it is missing.
        names = [name for name in ("t_s", "throttle", *FITTED) if name in columns]
        used = {name: np.asarray(columns[name], np.float64) for name in names}
        even, _ = even_arrays(used)
        return [(item, grade(even, item)) for item in detect_maneuvers(even)], []
    except IdentificationError as error:
        return [], [f"no maneuvers: {shown(str(error))}"]


def _losses(summary: Mapping[str, Any]) -> list[Happening]:
    found = []
    for loss in summary["losses"]["ranges"]:
        if loss.get("t_s") is not None:
            t_s = float(loss["t_s"])
            found.append(Happening(t_s, shown(loss["text"]), t_s + float(loss["seconds"] or 0.0)))
    return found


def _jumps(summary: Mapping[str, Any]) -> list[ServoJump]:
    return [
        ServoJump(float(t_s), channel)
        for session in summary.get("sessions", ())
        for channel, found in session.get("servo_jumps", {}).items()
        for t_s in found["t_s"]
    ]
