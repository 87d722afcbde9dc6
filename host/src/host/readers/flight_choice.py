"""One flight of a file that holds several, by its number behind the file's name: ``log.tlog#2``."""

from __future__ import annotations

from pathlib import Path

from host.errors import UsageError

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


def with_flight(sources: list[Path], flight: int | str | None) -> list[Path]:
    """Return the sources that a choice of ``--flight`` makes of files: with ``all`` each flight.

    Raises
    ------
    host.errors.HostError
        If a file cannot be read.
    """
    if flight is None:
        return sources
    if flight != ALL:
        return [Path(f"{source}{MARK}{flight}") for source in sources]
    return [
        Path(f"{source}{MARK}{number}") for source in sources for number in flight_numbers(source)
    ]


def flight_numbers(source: Path) -> list[int]:
    """Return the numbers of the flights of a log in which something flew.

    Raises
    ------
    UsageError
        If none did, or flights are of no concern to such a file.
    """
    from host.readers.autopilot_flight import is_autopilot_log, read_autopilot

    if not is_autopilot_log(source):
        raise UsageError(
            f"{source}: --flight all is for logs of PX4 and ArduPilot; name its number"
        )
    found = read_autopilot(source)
    flown = [one.number for one in found.listed if one.airborne_s > 0.0]
    return flown or [found.number]
