"""What a user points at: a file, a folder or a mounted card."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from host.blocks import HEADER, MAGIC
from host.errors import NotALogError, UsageError
from host.extents import BLOCK_BYTES

_ROW_SUFFIXES = (".txt", ".log", ".csv")


@dataclass(frozen=True, slots=True)
class Flight:
    """A log found in a folder.

    Parameters
    ----------
    path : Path
    session : int
        Session number in its first block: larger is newer.
    size_bytes : int
    modified_s : float
        As the file system says; a card written without GPS has no date.
    """

    path: Path
    session: int
    size_bytes: int
    modified_s: float


def find_flights(folder: Path) -> list[Flight]:
    """Return the logs of a folder and the folders right below it, oldest first.

    Raises
    ------
    NotALogError
        If there are none.
    """
    flights = []
    for path in sorted([*folder.glob("*"), *folder.glob("*/*")]):
        if path.suffix.lower() != ".bin" or not path.is_file():
            continue
        with path.open("rb") as file:
            head = file.read(BLOCK_BYTES)
        if head[:4] != MAGIC or len(head) < BLOCK_BYTES:
            continue
        session = int.from_bytes(head[8:12], "little")
        stat = path.stat()
        flights.append(Flight(path, session, stat.st_size, stat.st_mtime))
    if not flights:
        raise NotALogError(
            f"{folder.resolve()}: no flight log in this folder; expected files such as"
            " FLT00001.BIN, or name a log"
        )
    return sorted(flights, key=lambda flight: (flight.session, flight.modified_s, flight.path.name))


def check_source(path: Path) -> Path:
    """Return `path` if it exists.

    Raises
    ------
    UsageError
        If nothing is there.
    """
    if not path.exists():
        raise UsageError(f"{path}: no such file or folder")
    return path


assert HEADER.fields is not None and HEADER.fields["session"][1] == 8
