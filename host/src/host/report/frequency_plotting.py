"""`host plot --bode`: frequency responses of a flight, with those of the models fitted to it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from host.errors import ExitCode, UsageError
from host.export.atomic_files import atomic_write
from host.readers.flight_choice import with_flight
from host.report.embedded_picture import picture
from host.report.flight_page import page_text
from host.report.flight_reading import FlightRequest
from host.report.html_page import HtmlPage
from host.report.html_text import escaped
from host.report.plotting import Plotted, page_file, write_text
from host.sysid.pipeline import identify


@dataclass(frozen=True, slots=True)
class FrequencyRequest:
    """What to draw; see ``host plot --help``."""

    wanted: FlightRequest
    output: Path | None = None
    pictures: tuple[Path, ...] = ()
    aircraft: str | None = None
    models: tuple[str, ...] = ()


def plot_frequency(request: FrequencyRequest) -> Plotted:
    """Identify, and write the frequency responses as a page, as pictures, or both.

    Raises
    ------
    HostError
        As `host.identify`; UsageError if nothing is coherent or a place cannot be written to.
    """
    wanted = request.wanted
    if wanted.file_id is not None:
        raise UsageError("--file-id: --bode takes a whole log; choose a flight with --flight")
    for path in request.pictures:
        if path.suffix.lower() not in (".png", ".svg"):
            raise UsageError(f"{path}: a picture's name ends in .png or .svg")
    found = identify(
        with_flight(wanted.source, wanted.session),
        aircraft=request.aircraft,
        models=list(request.models) or None,
        calibration=wanted.calibration,
        mapping=wanted.mapping,
        sensors=dict(wanted.sensors),
        row_rate_hz=wanted.row_rate_hz,
    )
    figures, lines = found.frequency()
    if not figures:
        raise UsageError("; ".join(lines) or "no linear model to draw a frequency response of")
    files: list[Path] = []
    for path in request.pictures:
        with atomic_write(path) as part:
            figures[0].savefig(part, format=path.suffix[1:].lower(), dpi=200)
        files.append(path)
    if request.output is not None or not files:
        name = wanted.source.name
        target = page_file(request.output, wanted.source, ".bode.html")
        said = "\n".join(map(escaped, lines))
        body = f"<h1>Frequency responses of {escaped(name)}</h1><pre>{said}</pre>"
        page = HtmlPage(
            title=f"Frequency responses: {name}",
            body=body + "".join(picture(figure, "frequency responses") for figure in figures),
            style=page_text("report.css"),
        )
        write_text(target, page.text())
        files.append(target)
    lines += [f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)" for path in files]
    return Plotted(files, [*(f"note: {note}" for note in found.notes), *lines], ExitCode.OK)
