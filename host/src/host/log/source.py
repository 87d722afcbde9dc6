"""Find logs in what a user names: a file, a folder or a mounted card."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from host.errors import NotALogError
from host.files.regular import file_or_folder
from host.wire.blocks import scan

# How much of each file in a folder is read: more than a few destroyed blocks cover.
_HEAD_BYTES = 64 << 10


@dataclass(frozen=True, slots=True)
class Flight:
    """A log found in a folder.

    Parameters
    ----------
    path : Path
    session : int
        Session number in its first intact block: larger is newer.
    size_bytes : int
    modified_s : float
        As the file system says; a card written without GPS has no date.
    recorded : bool
        False for a file the logger has prepared for its next flight and not yet written to.
    """

    path: Path
    session: int
    size_bytes: int
    modified_s: float
    recorded: bool


def find_flights(folder: Path) -> list[Flight]:
    """Return the logs of a folder and the folders right below it, oldest first.

    Raises
    ------
    NotALogError
        If there are none.
    OSError
        If the folder or one of its logs cannot be read.
    """
    flights = [flight for path in _candidates(folder) if (flight := _look_at(path)) is not None]
    if not flights:
        raise NotALogError(
            f"{folder.resolve()}: no flight log in this folder; expected files such as"
            " FLT00001.BIN, or name a log"
        )
    return sorted(flights, key=lambda flight: (flight.session, flight.modified_s, flight.path.name))


def newest(folder: Path, flights: list[Flight]) -> Flight:
    """Return the newest of the flights that were recorded.

    Raises
    ------
    NotALogError
        If all are files prepared for a flight.
    """
    recorded = [flight for flight in flights if flight.recorded]
    if not recorded:
        raise NotALogError(
            f"{folder.resolve()}: no flight recorded yet, only files prepared for one"
            f" ({', '.join(flight.path.name for flight in flights)})"
        )
    return recorded[-1]


def check_source(path: Path) -> Path:
    """Return `path` if it is a file or a folder.

    Raises
    ------
    UsageError
        If nothing is there, or something that cannot be read twice.
    """
    return file_or_folder(path)


def _candidates(folder: Path) -> Iterator[Path]:
    for path in sorted([*folder.iterdir(), *folder.glob("*/*")]):
        if path.suffix.lower() == ".bin" and path.is_file():
            yield path


def _look_at(path: Path) -> Flight | None:
    found = scan(path, limit_bytes=_HEAD_BYTES).blocks
    if not len(found):
        return None
    own = found.file_id == found.file_id[0]
    stat = path.stat()
    # The file's first block is written when it is made, on the ground; all others record.
    recorded = bool((found.sequence[own] > 0).any())
    return Flight(path, int(found.session[0]), stat.st_size, stat.st_mtime, recorded)
