"""`host report`: identify and write the report page."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.aircraft.prior.aircraft_prior import has_coefficients
from host.errors import HostError, IdentificationError, UsageError
from host.files.user_text import read_text
from host.original.rows import looks_like_rows
from host.preflight.preflight_sheet import sheet_lines, sheet_of
from host.readers.autopilot_flight import is_autopilot_log
from host.readers.flight_choice import file_and_flight
from host.readers.foreign_tables import TEXT_KINDS
from host.readers.readable_file import readable_file
from host.report.flight_reading import TABLES, FlightRequest, read_flight
from host.report.gains_section import check_gains, gains_section
from host.report.plotting import page_file, write_text
from host.report.provenance import hashes, versions
from host.report.report_page import ReportParts, report_page
from host.report.shown_flight import ShownFlight
from host.sysid.pipeline import identify

if TYPE_CHECKING:
    from host.sysid.pipeline import Identification

_SECOND_METHOD = "equation-error"
_HEAD_BYTES = 4096


@dataclass(frozen=True, slots=True)
class ReportRequest:
    """What to write up; see ``host report --help``.

    Attributes
    ----------
    sources : list of Path
    calibrations : list of (Path or None)
        One of each source.
    options : mapping
        Further arguments of `host.identify`.
    files : list of Path
        Further input files (aircraft, prior), for the appendix.
    tune : str or None
        Autopilot to find gains for.
    """

    sources: list[Path]
    calibrations: list[Path | None]
    options: Mapping[str, Any]
    command: str
    output: Path | None = None
    preflight: Path | None = None
    files: list[Path] = field(default_factory=list)
    tune: str | None = None


def write_report(request: ReportRequest) -> tuple[Path, Identification]:
    """Identify, write the page, return its path and the identification.

    Raises
    ------
    HostError
        As `host.identify`; UsageError if the place cannot be written to.
    """
    aircraft = request.options.get("aircraft")
    if request.tune:
        check_gains(request.tune, aircraft)
    files = list(dict.fromkeys(file_and_flight(one)[0] for one in request.sources))
    first = files[0]
    target = page_file(request.output, first if first.suffix else first / "flight", ".report.html")
    if request.output is None:
        target = _not_there_yet(target)
    if any(target.exists() and target.samefile(one) for one in files):
        raise UsageError(f"{target} is the source itself; name another file with -o")
    sheet = _sheet(request.preflight or sheet_of(first))
    options = dict(request.options)
    if options.get("prior") is None and options.get("aircraft") is not None:
        own = options["aircraft"]
        options["prior"] = own if has_coefficients(own) else None
    found = identify(request.sources, **options)
    second = None if options.get("methods") else _second_method(request.sources, options, found)
    flights = [
        flight
        for source, calibration in zip(request.sources, request.calibrations, strict=True)
        if (flight := _flight(source, calibration, request.options)) is not None
    ]
    calibrations = {one for one in request.calibrations if one is not None}
    others = [one for one in request.files if one not in calibrations]
    parts = ReportParts(
        found=found,
        second=second,
        flights=flights,
        aircraft=str(aircraft or ""),
        versions=versions(),
        hashes=hashes([*files, *sorted(calibrations), *others]),
        command=request.command,
        sheet=sheet,
        calibrations=hashes(sorted(calibrations)),
        gains=gains_section(found, request.tune, str(aircraft), first) if request.tune else "",
    )
    write_text(target, report_page(parts))
    return target, found


def _not_there_yet(path: Path) -> Path:
    """Return a path, with a number where there is a file: a report of before is kept."""
    numbers = itertools.count(2)
    stem = path.name.removesuffix(".report.html")
    while path.exists():
        path = path.with_name(f"{stem}-{next(numbers)}.report.html")
    return path


def _second_method(
    sources: list[Path], options: Mapping[str, Any], found: Identification
) -> Identification | None:
    """Return the same flights by a second method, to compare with the first; None if it has none.

    A regression shares no search and no start value with the methods that fit histories, and takes
    a second.
    """
    if not found.linear:
        return None
    try:
        return identify(sources, **{**options, "methods": [_SECOND_METHOD]})
    except IdentificationError:
        return None


def _flight(
    source: Path, calibration: Path | None, options: Mapping[str, Any]
) -> ShownFlight | None:
    """Return a log as a flight to show; None for a table, which has no events and losses."""
    if readable_file(file_and_flight(source)[0]).suffix.lower() in TABLES:
        return None
    try:
        return read_flight(_flight_request(source, calibration, options))[0]
    except HostError:
        if source.suffix.lower() in TEXT_KINDS:  # a table under another name
            return None
        raise


def _flight_request(
    source: Path, calibration: Path | None, options: Mapping[str, Any]
) -> FlightRequest:
    source, flight = file_and_flight(source)
    source = readable_file(source)
    if is_autopilot_log(source):
        chosen = tuple(options.get("sensors", {}).items())
        return FlightRequest(source, session=flight, sensors=chosen)
    rows = False
    if source.is_file():
        with source.open("rb") as file:
            rows = looks_like_rows(file.read(_HEAD_BYTES))
    rate_hz = options.get("row_rate_hz") if rows else None
    return FlightRequest(source, session=flight, calibration=calibration, row_rate_hz=rate_hz)


def _sheet(path: Path | None) -> tuple[str, list[str]] | None:
    if path is None:
        return None
    text = read_text(path, UsageError, "a preflight sheet", "replace")
    return f"Preflight sheet {path.name}", sheet_lines(text) or text.splitlines()
