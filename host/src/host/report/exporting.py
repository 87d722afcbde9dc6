"""`host export`: write a flight as a file for another program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from host.errors import ExitCode, UsageError
from host.export.atomic_files import atomic_write
from host.export.gpx_writer import write_gpx
from host.export.kml_writer import write_kml
from host.extras import install_hint
from host.report.flight_geography import flight_geography
from host.report.flight_mcap import write_flight_mcap
from host.report.flight_reading import FlightRequest, read_flight
from host.report.flight_tlog import write_flight_tlog
from host.report.flight_ulog import write_flight_ulog
from host.report.plotjuggler_layout import PREFIX, write_layout
from host.report.shown_flight import ShownFlight

ENDINGS = {"tlog": ".tlog", "ulog": ".ulg", "kml": ".kml", "kmz": ".kmz", "gpx": ".gpx",
           "mcap": ".mcap"}  # fmt: skip

_WITH_POINTS = {"kml", "kmz", "gpx"}  # formats that show test points


@dataclass(frozen=True, slots=True)
class ExportRequest:
    """What to export; see ``host export --help``."""

    wanted: FlightRequest
    kinds: tuple[str, ...]
    output: Path | None = None
    rate_hz: float | None = None


def export(request: ExportRequest) -> tuple[list[Path], list[str], ExitCode]:
    """Read a flight and write it for other programs; return files, words and exit code.

    Raises
    ------
    UsageError, NotALogError, LogError, CalibrationError
        See `host.decode.decoding.decode`; a library is missing, or there is no place to write.
    """
    if request.rate_hz is not None and (request.rate_hz <= 0.0 or "tlog" not in request.kinds):
        raise UsageError(f"--rate {request.rate_hz:g}: a positive rate, of --to tlog only")
    with_points = bool(set(request.kinds) & _WITH_POINTS)
    flight, source = read_flight(replace(request.wanted, maneuvers=with_points))
    files: list[Path] = []
    for kind in request.kinds:
        target = _target(request, kind, source)
        _write(kind, flight, target, request.rate_hz)
        files.append(target)
        if kind in PREFIX:
            layout = target.with_name(f"{target.stem}.{kind}.plotjuggler.xml")
            with atomic_write(layout) as part:
                write_layout(flight, part, kind)
            files.append(layout)
    said = list(flight.notes)
    if flight.utc_s is None and set(request.kinds) - {"ulog"}:
        said.append("no GPS date in the log: 2000-01-01 stands for the flight's beginning")
    losses = flight.summary["losses"]["ranges"]
    if losses:
        said.append(f"{len(losses)} ranges are lost: gaps in what was written")
    said += [f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)" for path in files]
    return files, said, ExitCode.LOSSES if losses else ExitCode.OK


def _target(request: ExportRequest, kind: str, source: Path) -> Path:
    output, ending = request.output, ENDINGS[kind]
    if output is None:
        target = Path(f"{source.stem}{ending}")
    elif output.is_dir() or not output.suffix:
        target = output / f"{source.stem}{ending}"
    elif len(request.kinds) > 1:
        target = output.with_suffix(ending)
    elif output.suffix.lower() != ending:
        raise UsageError(f"-o {output}: a name of --to {kind} ends in {ending}")
    else:
        target = output
    if target.exists() and target.samefile(source):
        raise UsageError(f"{target} is the source itself; name another file with -o")
    return target


def _write(kind: str, flight: ShownFlight, target: Path, rate_hz: float | None) -> None:
    makers: dict[str, Callable[[Path], None]] = {
        "tlog": lambda part: write_flight_tlog(flight, part, rate_hz),
        "ulog": lambda part: write_flight_ulog(flight, part),
        "kml": lambda part: write_kml(part, flight_geography(flight)),
        "kmz": lambda part: write_kml(part, flight_geography(flight)),
        "gpx": lambda part: write_gpx(part, flight_geography(flight)),
        "mcap": lambda part: write_flight_mcap(flight, part),
    }
    with atomic_write(target) as part:
        try:
            makers[kind](part)
        except ModuleNotFoundError as error:
            name = (error.name or "").split(".")[0]
            raise UsageError(f"--to {kind} needs {name}: {install_hint(name)}") from None
