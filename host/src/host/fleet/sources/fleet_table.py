"""Which log belongs to which aircraft: a table, else the log's folder.

    source,serial,aircraft,type,file,calibration,map,date
    north/**,,N-01,trainer,trainer.toml,logger7.toml,,
    ,6d6f636b,N-02,trainer,trainer.toml,logger8.toml,,

A row belongs to the logs that its pattern or folder names, or whose card or autopilot has its
serial. The first row that fits counts. Paths are from the table's folder.
"""

from __future__ import annotations

import csv
import fnmatch
import re
from dataclasses import dataclass
from pathlib import Path

from host.errors import HostError
from host.fleet.fleet_error import FleetError
from host.fleet.sources.flight_files import is_address

COLUMNS = ("source", "serial", "aircraft", "type", "file", "calibration", "map", "date")
_PATHS = ("file", "calibration", "map")
_MOST_BYTES = 64 << 20


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row; an empty field states nothing."""

    source: str = ""
    serial: str = ""
    aircraft: str = ""
    type: str = ""
    file: str = ""
    calibration: str = ""
    map: str = ""
    date: str = ""


def read_table(path: Path) -> list[TableRow]:
    """Return the rows of a table.

    Raises
    ------
    FleetError
        If it cannot be read, or a row names neither source nor serial.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise FleetError(f"{path}: larger than 64 MiB, expected a table of sources")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FleetError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise FleetError(f"{path}: no text in UTF-8; save it as CSV in UTF-8") from None
    lines = csv.DictReader(text.splitlines())
    unknown = [name for name in lines.fieldnames or () if name not in COLUMNS]
    if unknown or not lines.fieldnames:
        found = f"column {unknown[0]!r}" if unknown else "no columns"
        raise FleetError(f"{path}: {found}, expected of {','.join(COLUMNS)}")
    rows = []
    for number, line in enumerate(lines, start=2):
        cells = {name: (line.get(name) or "").strip() for name in COLUMNS}
        if None in line or not (cells["source"] or cells["serial"]):
            raise FleetError(f"{path}: line {number} names no source and no serial")
        if cells["date"] and not re.fullmatch(r"\d{4}-\d\d-\d\d", cells["date"]):
            raise FleetError(
                f"{path}: line {number}: date {cells['date']!r}, expected such as 2026-11-23"
            )
        for name in _PATHS:
            cells[name] = _relative_to_table(path, cells[name])
        if cells["source"] and not is_address(cells["source"]):
            cells["source"] = (path.parent / cells["source"]).as_posix()
        rows.append(TableRow(**cells))
    return rows


def row_of(source: str, rows: list[TableRow]) -> TableRow | None:
    """Return the row of a log; None where no row fits."""
    serial: str | None = None
    for row in rows:
        if row.source and not _names(row.source, source):
            continue
        if row.serial:
            serial = serial_of(source) if serial is None else serial
            if row.serial.lower() not in serial:
                continue
        return row
    return None


def serial_of(source: str) -> str:
    """Return the identity in a log of ours: serial of its card, name set for its aircraft."""
    from host.log.head import describe

    if is_address(source):
        return ""
    try:
        head = describe(Path(source))
    except (HostError, OSError):
        return ""
    parts = (head.get("identity", {}).get("card_id", ""), head.get("config", {}).get("aircraft"))
    return " ".join(str(p).lower() for p in parts if p)


def _names(pattern: str, source: str) -> bool:
    own, other = _plain(source), _plain(pattern)
    return fnmatch.fnmatchcase(own, other) or own.startswith(f"{other.rstrip('/')}/")


def _plain(source: str) -> str:
    return source if is_address(source) else Path(source).absolute().as_posix()


def _relative_to_table(table: Path, name: str) -> str:
    """Return a file's path from the table's folder, or a name that is no file there."""
    near = table.parent / name
    return near.as_posix() if name and near.is_file() else name
