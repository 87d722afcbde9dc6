"""The flight a verb takes where none is named: the newest of the working folder."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from host.errors import NotALogError


def source_or_newest(source: Path | None) -> Path:
    """Return SOURCE; without one the newest flight of the working folder, and say which.

    Raises
    ------
    NotALogError
        If the folder and those right below it hold no flight.
    """
    if source is not None:
        return source
    from host.text import shown

    path = newest_flight(Path())
    print(f"host: the newest flight here: {shown(str(path))}", file=sys.stderr)
    return path


def newest_flight(folder: Path) -> Path:
    """Return the newest flight of a folder and the folders right below it.

    Our logger's by their session; where there are none, the youngest log of PX4 or ArduPilot or
    file of original rows.

    Raises
    ------
    NotALogError
        If there is none.
    """
    from host.log.source import find_flights, newest

    try:
        return newest(folder, find_flights(folder)).path
    except NotALogError:
        others = sorted(_others(folder), key=lambda path: (path.stat().st_mtime, path.name))
        if not others:
            raise
        return others[-1]


def _others(folder: Path) -> Iterator[Path]:
    from host.original.rows import looks_like_rows
    from host.readers.autopilot_flight import is_autopilot_log

    for path in [*folder.iterdir(), *folder.glob("*/*")]:
        kind = path.suffix.lower()
        if not path.is_file():
            continue
        if kind == ".txt":
            with path.open("rb") as file:
                if looks_like_rows(file.read(4096)):
                    yield path
        elif kind in (".ulg", ".bin", ".log", ".tlog") and is_autopilot_log(path):
            yield path
