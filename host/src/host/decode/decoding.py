"""`host decode`: from a request to files and a summary."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from host.decode.log_summary import summarise
from host.decode.summary_text import lines
from host.decode.writing import Request, destination, write_frames, write_table
from host.errors import ExitCode, UsageError
from host.export.writer import Meta
from host.log import FlightLog, read_log
from host.log.source import check_source, find_flights, newest
from host.original.row_summary import row_lines, row_meta, summarise_rows
from host.original.row_table import make_table
from host.original.rows import looks_like_rows, read_rows
from host.physical.calibration import load_calibration
from host.physical.columns import COLUMNS, UNITS
from host.progress import progress_bar
from host.readers.autopilot_flight import is_autopilot_log, read_autopilot
from host.readers.autopilot_summary import autopilot_meta, summarise_autopilot, summary_lines
from host.readers.gzip_file import given_path
from host.readers.readable_file import readable_file, refuse_table
from host.terminal import command_line
from host.text import shown

_HEAD_BYTES = 4096


@dataclass(slots=True)
class Decoded:
    """Result of decoding: files and summary.

    Parameters
    ----------
    summary : dict
        Plain data; ``files`` names what was written.
    lines : list of str
        The summary in words.
    """

    summary: dict[str, Any]
    lines: list[str] = field(default_factory=list)

    def exit_code(self, *, strict: bool) -> ExitCode:
        """Return the documented exit code."""
        if strict and self.faults():
            return ExitCode.CHECK
        return ExitCode.LOSSES if self.summary["losses"]["ranges"] else ExitCode.OK

    def faults(self) -> list[str]:
        """Return the reasons for which --strict fails."""
        found = []
        if self.summary["losses"]["ranges"]:
            found.append(f"{len(self.summary['losses']['ranges'])} lost ranges")
        if self.summary["complete"] != "complete":
            found.append(f"the log is {self.summary['complete']}")
        for session in self.summary.get("sessions", ()):
            for kind in ("stuck", "saturated", "absent"):
                found += [f"{name} {kind}" for name in session[kind]]
            pairs = session["pairs"].items()
            found += [f"{name} pair disagrees" for name, pair in pairs if pair["disagrees"]]
        return found


def decode(request: Request) -> Decoded:
    """Decode one log and write its table.

    Raises
    ------
    UsageError, NotALogError, LogError, CalibrationError
        See `host.read_log`.
    """
    path = readable_file(pick(check_source(request.source)))
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if looks_like_rows(head):
        return decode_rows(request, path)
    if is_autopilot_log(path):
        return decode_autopilot(request, path)
    refuse_table(path)
    if request.row_rate_hz is not None:
        raise UsageError(f"{path}: a log carries its times; --row-rate is for original ASCII rows")
    kind, target = destination(request, path)
    size = path.stat().st_size
    log = read_log(
        path,
        session=request.session,
        file_id=request.file_id,
        calibration=request.calibration,
        progress=progress_bar("reading", size),
    )
    summary = finite(summarise(log))
    files = []
    if summary["rows"]:
        meta = table_meta(log, summary)
        write_table(log.pieces(), kind, target, meta)
        files.append(str(target))
    if request.frames:
        files += write_frames(log, kind, target)
    summary["files"] = files
    summary["next"] = next_command(files, request, given_path(path))
    said = [*lines(summary), *(f"{'wrote':<13}{name}" for name in files)]
    if not summary["rows"]:
        said.append(f"{'wrote':<13}no table: the log holds no identification frame")
    said.append(f"{'next':<13}{summary['next']}")
    return Decoded(summary, said)


def decode_rows(request: Request, path: Path) -> Decoded:
    """Decode a file of the original ASCII rows and write its table."""
    for name, value in (("flight", request.session), ("file-id", request.file_id)):
        if value is not None:
            raise UsageError(f"{path}: original ASCII rows have no --{name}")
    if request.frames:
        raise UsageError(f"{path}: original ASCII rows have no raw frames; leave --frames out")
    kind, target = destination(request, path)
    calibration = load_calibration(request.calibration)
    rows = read_rows(path)
    table = make_table(rows, calibration, request.row_rate_hz)
    summary = finite(summarise_rows(path, rows, table, calibration))
    write_table([table.columns], kind, target, row_meta(path, summary))
    summary["files"] = [str(target)]
    rate = ("--row-rate", f"{request.row_rate_hz:g}" if request.row_rate_hz else "HZ")
    summary["next"] = (
        command_line("host", "maneuvers", given_path(path), *(rate if request.row_rate_hz else ()))
        if table.rate.known
        else command_line("host", "decode", given_path(path), *rate, *_own(request))
    )
    said = [*row_lines(summary), f"{'wrote':<13}{target}", f"{'next':<13}{summary['next']}"]
    return Decoded(summary, said)


def decode_autopilot(request: Request, path: Path) -> Decoded:
    """Decode a log of another autopilot and write its table: a row for each instant of a message.

    Raises
    ------
    UsageError
        If an option is for logs of ours.
    """
    asked = {
        "file-id": request.file_id, "row-rate": request.row_rate_hz,
        "calibration": request.calibration, "frames": request.frames or None,
    }  # fmt: skip
    for name, value in asked.items():
        if value is not None:
            raise UsageError(f"{path}: a log of an autopilot has no --{name}")
    kind, target = destination(request, path)
    flight = read_autopilot(path, dict(request.sensors), request.session)
    summary = finite(summarise_autopilot(flight))
    columns = flight.columns()
    if columns:
        write_table([columns], kind, target, autopilot_meta(summary))
    summary["files"] = [str(target)] if columns else []
    verb = "info" if flight.judgement.refusal else "maneuvers"
    which = () if request.session is None else ("--flight", str(request.session))
    summary["next"] = command_line("host", verb, given_path(path), *which)
    said = [*summary_lines(summary), *(f"{'wrote':<13}{name}" for name in summary["files"])]
    said.append(f"{'next':<13}{summary['next']}")
    return Decoded(summary, said)


def pick(source: Path) -> Path:
    """Return the file to decode; of a folder the newest flight, after listing all on stderr."""
    if not source.is_dir():
        return source
    flights = find_flights(source)
    chosen = newest(source, flights)
    for flight in flights:
        mark = "->" if flight is chosen else "  "
        note = "" if flight.recorded else ", prepared, nothing recorded"
        said = f"{mark} {flight.path}  session {flight.session}, {flight.size_bytes} bytes{note}"
        print(shown(said), file=sys.stderr)
    return chosen.path


def table_meta(log: FlightLog, summary: dict[str, Any]) -> Meta:
    """Return the metadata of a table."""
    note = summary["calibration"]
    return Meta(
        units=UNITS,
        texts={column.name: column.text for column in COLUMNS},
        notes={
            "source": str(log.path.name),
            "file_id": summary["file_id"],
            "complete": summary["complete"],
            "losses": str(len(summary["losses"]["ranges"])),
            "inputs": ", ".join(f"{key} {value}" for key, value in log.inputs.items()),
            "calibration_name": note["name"],
            "calibration_date": note["date"],
            "default_columns": ", ".join(note["default_columns"]),
            "delays_us": ", ".join(f"{key} {value}" for key, value in summary["delays_us"].items()),
            "calibration": log.calibration.text,
        },
    )


def next_command(files: list[str], request: Request, source: Path) -> str:
    """Return the command to try next, as it can be pasted; the calibration goes with it."""
    if not files:
        return command_line("host", "info", source)
    return command_line("host", "maneuvers", source, *_own(request))


def _own(request: Request) -> tuple[str | Path, ...]:
    return ("--calibration", request.calibration) if request.calibration else ()


def finite(value: Any) -> Any:
    """Return plain data without NaN and infinity, which JSON does not have."""
    if isinstance(value, dict):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
