"""`host plot`: write a flight's page and pictures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from host.errors import ExitCode, UsageError
from host.export.atomic_files import atomic_write
from host.report.flight_page import flight_page
from host.report.flight_reading import FlightRequest, read_flight
from host.report.strip_figure import write_figure


@dataclass(frozen=True, slots=True)
class PlotRequest:
    """What to draw; see ``host plot --help``."""

    wanted: FlightRequest
    output: Path | None = None
    full: bool = False
    pictures: tuple[Path, ...] = ()
    channels: tuple[str, ...] = ()
    span: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True, slots=True)
class Plotted:
    """Files written, lines for the user, exit code."""

    files: list[Path]
    lines: list[str]
    exit_code: ExitCode


def plot(request: PlotRequest) -> Plotted:
    """Read a flight and write its page, its pictures, or both.

    Raises
    ------
    UsageError, NotALogError, LogError, CalibrationError
        See `host.decode.decoding.decode`.
    """
    flight, source = read_flight(request.wanted)
    files: list[Path] = []
    for path in request.pictures:
        write_figure(flight, path, request.channels, request.span)
        files.append(path)
    if request.output is not None or not request.pictures:
        target = page_file(request.output, source)
        write_text(target, flight_page(flight, full=request.full))
        files.append(target)
    lost = bool(flight.summary["losses"]["ranges"])
    points = f"{len(flight.maneuvers)} test points" if flight.maneuvers else "no test point"
    said = [f"{flight.name}: {flight.summary['duration_s']:.1f} s, {points}"]
    said += flight.notes
    said += [f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)" for path in files]
    return Plotted(files, said, ExitCode.LOSSES if lost else ExitCode.OK)


def page_file(output: Path | None, source: Path, ending: str = ".html") -> Path:
    """Return where a page goes: into the working folder without a name of the user's."""
    if output is None:
        return Path(f"{source.stem}{ending}")
    if output.is_dir():
        return output / f"{source.stem}{ending}"
    if output.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"-o {output}: a page's name ends in .html")
    return output


def write_text(target: Path, text: str) -> None:
    """Write a text file that appears only when it is whole.

    Raises
    ------
    UsageError
        If the place cannot be written to.
    """
    with atomic_write(target) as part:
        part.write_text(text, encoding="utf-8", newline="\n")
