"""From a request to files and a summary: what `host decode` does."""

from __future__ import annotations

import importlib.util
import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from host.columns import COLUMNS, UNITS
from host.errors import ExitCode, UsageError
from host.export import FORMATS, open_writer
from host.export.csv import printable
from host.export.writer import Columns, Meta
from host.log import FlightLog, read_log
from host.progress import progress_bar
from host.report import lines
from host.source import check_source, find_flights
from host.summary import summarise


@dataclass(frozen=True, slots=True)
class Request:
    """What to decode and where to; see ``host decode --help``."""

    source: Path
    output: str | None = None
    format: str | None = None
    frames: bool = False
    session: int | None = None
    file_id: int | None = None
    calibration: Path | None = None


@dataclass(slots=True)
class Decoded:
    """What came of it.

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
        """Return what --strict does not forgive, in words."""
        found = []
        if self.summary["losses"]["ranges"]:
            found.append(f"{len(self.summary['losses']['ranges'])} lost ranges")
        for session in self.summary["sessions"]:
            for kind in ("stuck", "saturated", "absent"):
                found += [f"{name} {kind}" for name in session[kind]]
        return found


def decode(request: Request) -> Decoded:
    """Decode one log and write its table.

    Raises
    ------
    UsageError, NotALogError, LogError, CalibrationError
        See `host.read_log`.
    """
    path = pick(check_source(request.source))
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
    summary["next"] = next_command(files, path)
    said = [*lines(summary), *(f"{'wrote':<13}{name}" for name in files)]
    if not summary["rows"]:
        said.append(f"{'wrote':<13}no table: the log holds no identification frame")
    said.append(f"{'next':<13}{summary['next']}")
    return Decoded(summary, said)


def pick(source: Path) -> Path:
    """Return the file to decode; of a folder the newest flight, after listing all on stderr."""
    if not source.is_dir():
        return source
    flights = find_flights(source)
    for flight in flights:
        mark = "->" if flight is flights[-1] else "  "
        print(
            f"{mark} {flight.path}  session {flight.session}, {flight.size_bytes} bytes",
            file=sys.stderr,
        )
    return flights[-1].path


def destination(request: Request, source: Path) -> tuple[str, Path]:
    """Return format and file of the table.

    Raises
    ------
    UsageError
        If ending and --to disagree, or the table would overwrite its source.
    """
    output = request.output
    if output == "-":
        if request.format not in (None, "csv"):
            raise UsageError(f"--to {request.format} cannot go to stdout; name a file with -o")
        return "csv", Path("/dev/stdout")
    if output is None:
        kind = request.format or "csv"
        target = Path(f"{source.stem}.{kind}")
    else:
        named = Path(output)
        ending = named.suffix.lower().removeprefix(".")
        if named.is_dir() or output.endswith(("/", "\\")):
            kind = request.format or "csv"
            target = named / f"{source.stem}.{kind}"
        elif ending in FORMATS:
            if request.format not in (None, ending):
                raise UsageError(f"-o {output} ends in .{ending} but --to says {request.format}")
            kind, target = ending, named
        else:
            kind = request.format or "csv"
            target = named.with_name(f"{named.name}.{kind}")
    if target.exists() and target.samefile(source):
        raise UsageError(f"{target} is the source itself; name another file with -o")
    if not target.parent.exists():
        target.parent.mkdir(parents=True)
    return kind, target


def table_meta(log: FlightLog, summary: dict[str, Any]) -> Meta:
    """Return what a table says of itself."""
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


def write_table(pieces: Iterable[Columns], kind: str, target: Path, meta: Meta) -> None:
    """Write a table piece by piece."""
    writer = open_writer(kind, target, meta)
    try:
        for piece in pieces:
            writer.write(piece)
    finally:
        writer.close()


def write_frames(log: FlightLog, kind: str, target: Path) -> list[str]:
    """Write every kind of raw frame to a file of its own; return the files."""
    folder = target.with_suffix(".frames")
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, frame in log.schema.by_name.items():
        data = log.frames[name]
        if not len(data):
            continue
        columns: dict[str, Any] = {}
        units = {}
        for part in frame.fields:
            value = data[part.name]
            scale = f"{part.scale:g} " if part.scale != 1.0 and part.unit else ""
            if value.ndim == 1:
                columns[part.name] = value
                units[part.name] = scale + part.unit
            else:
                for at in range(value.shape[1]):
                    columns[f"{part.name}_{at}"] = value[:, at]
                    units[f"{part.name}_{at}"] = scale + part.unit
        file = folder / f"{name}.{kind}"
        notes = {"source": log.path.name, "frame": name, "content": "raw counts"}
        write_table([printable(columns)], kind, file, Meta(units=units, notes=notes))
        files.append(str(file))
    return files


def next_command(files: list[str], source: Path) -> str:
    """Return the command to try next."""
    if files and importlib.util.find_spec("host.verbs.maneuvers") is not None:
        return f"host maneuvers {source}"
    return f"host decode {source} --to parquet" if files else f"host info {source}"


def finite(value: Any) -> Any:
    """Return plain data without NaN and infinity, which JSON does not have."""
    if isinstance(value, dict):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
