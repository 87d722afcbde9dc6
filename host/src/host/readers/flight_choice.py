"""One flight of a file that holds several, by its number behind the file's name: ``log.tlog#2``."""

from __future__ import annotations

from pathlib import Path

ALL = "all"
MARK = "#"


def file_and_flight(source: Path) -> tuple[Path, int | None]:
    """Return the file behind a name, and the number of the flight in it; None where none is said.

    A file that has such a name itself is that file.
    """
    file, mark, number = str(source).rpartition(MARK)
    if mark and number.isascii() and number.isdigit() and not source.exists():
        return Path(file), int(number)
    return source, None


def with_flight(source: Path, flight: int | None) -> Path:
    """Return the source that a flight of a file is; without a number the file itself."""
    return source if flight is None else Path(f"{source}{MARK}{flight}")
