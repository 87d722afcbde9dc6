"""The report of an identification as one page to mail and to print."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from host.report.answer_section import answer_section
from host.report.embedded_picture import picture
from host.report.fit_section import fit_table, mode_table
from host.report.flight_page import page_text
from host.report.flight_sections import (
    calibration_and_preflight,
    data_health,
    escaped_lines,
    maneuver_cards,
    sensor_agreement,
)
from host.report.html_page import HtmlPage
from host.report.html_table import items, table
from host.report.html_text import escaped
from host.report.json_numbers import JsonNumbers
from host.report.model_histories import caption, model_histories
from host.report.parameter_section import method_comparison, parameter_tables
from host.report.shown_flight import ShownFlight, is_simulated
from host.report.strip_figure import overview_figure
from host.report.track_figure import track_figure
from host.sysid.answer.mat_file import labels

if TYPE_CHECKING:
    from host.sysid.pipeline import Identification

_SECOND = "second"  # file of the second method's numbers in the page


@dataclass(frozen=True, slots=True)
class ReportParts:
    """Contents of a report.

    Attributes
    ----------
    found : Identification
    second : Identification or None
        The same flights by a second method, for comparison only: no verdict is given of it.
    flights : list of ShownFlight
        Flights of the sources that are logs.
    aircraft : str
        Name or file; empty without one.
    versions, hashes : dict of str to str
    command : str
        As it can be pasted.
    sheet : (str, list of str) or None
        Heading and lines of the preflight sheet.
    gains : str
        Markup of gains for an autopilot; empty where none were asked for.
    """

    found: Identification
    flights: list[ShownFlight]
    aircraft: str
    versions: dict[str, str]
    hashes: dict[str, str]
    command: str
    sheet: tuple[str, list[str]] | None = None
    calibrations: dict[str, str] = field(default_factory=dict)
    second: Identification | None = None
    gains: str = ""


def report_page(parts: ReportParts) -> str:
    """Return the page as text; every number of the answer is that of its ``result.json``."""
    found = parts.found
    text = found.to_json()
    numbers = JsonNumbers(json.loads(text))
    sources = numbers.document["source"]
    sources = sources if isinstance(sources, list) else [sources]
    called = [*labels(found.linear), *(["coefficients"] if found.coefficients else [])]
    titles = _titles(numbers)
    figures = found.plot()
    cards = maneuver_cards(parts.flights, numbers.document["answers"])
    others = parts.second.to_json() if parts.second else ""
    second = [JsonNumbers(json.loads(others), _SECOND)] if others else []
    models = [answer["template"] for answer in numbers.document["answers"]]
    inputs = {  # the first method's: those of the others are the same
        f"{label}_input": f"{model}: spectra of the inputs"
        for at, (label, model) in enumerate(zip(called, models, strict=True))
        if model not in models[:at]
    }
    poles = {
        f"{label}_poles": f"{title}: poles" for label, title in zip(called, titles, strict=True)
    }
    body = [
        f"<h1>Identification of {escaped(parts.aircraft or 'an aircraft without a file')}</h1>",
        f'<p class="facts">{escaped(", ".join(sources))}</p>',
        _simulated(parts),
        _data_lines(parts.flights),
        f'<div class="answer"><h2>Answer</h2>{answer_section(found.summary)}</div>',
        '<div class="pair">'
        + _section("What to fly next", items(found.summary.fly_lines()))
        + _section("What to measure on the ground", items(found.summary.measure_lines()))
        + "</div>",
        _findings(found),
        _section("Measured and model", _pair(
            _fit_picture(found, figures, at, label, titles[at]) for at, label in enumerate(called)
        )),
        _section("Estimates", "".join(
            _estimates(found, numbers, at, label, titles[at]) for at, label in enumerate(called)
        )),
        _section("Modes", mode_table(numbers, called, titles)),
        _section("Gains", parts.gains),
        _section("Flight", _overview(parts.flights) + cards),
        '<section class="behind"><h2>Behind the answer</h2>',
        _folded("Every reason of every mark", _reasons(found)),
        _folded("Intervals and poles", _pair(
            [_pictures(figures, {f"{label}_intervals": f"{title}: 95 % intervals"})
             for label, title in zip(called, titles, strict=True)] + [_pictures(figures, poles)]
        )),
        _folded("Frequency responses", "".join(
            _pictures(figures, {f"{label}_bode": f"{title}: frequency responses"})
            for label, title in zip(called, titles, strict=True)
        )),
        _folded("Errors of prediction", "".join(
            f"<h4>{escaped(titles[at])}</h4>{fit_table(numbers, at)}" for at in range(len(called))
        )),
        _folded("Spectra of the inputs", _pictures(figures, inputs)),
        _folded("Methods side by side", _methods(numbers, second)),
        _folded("Sensor agreement", sensor_agreement(numbers)),
        _folded("Data health", data_health(parts.flights, sources)),
        _folded("Calibration and preflight",
                calibration_and_preflight(parts.flights, parts.calibrations, parts.sheet)),
        _folded("Command, versions, files",
                _appendix(parts, {"result": text} | ({_SECOND: others} if others else {}))),
        "</section>",
    ]  # fmt: skip
    return HtmlPage(
        title=f"Identification: {parts.aircraft or sources[0]}",
        body="\n".join(body),
        style=page_text("report.css"),
    ).text()


def _section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>{content}</section>" if content else ""


def _titles(numbers: JsonNumbers) -> list[str]:
    """Return the name of each answer: its model, and its method where several were asked for."""
    answers = numbers.document["answers"]
    models = [answer["template"] for answer in answers]
    return [
        f"{answer['template']}, {answer['method']}" if models.count(answer["template"]) > 1
        else answer["template"]
        for answer in answers
    ]  # fmt: skip


def _simulated(parts: ReportParts) -> str:
    """Return a line if any of the flights was simulated."""
    recorders = any(is_simulated(flight.summary) for flight in parts.flights)
    if not recorders and parts.found.truth is None:
        return ""
    return '<p class="facts"><strong>Simulated: this aircraft was not flown.</strong></p>'


def _methods(numbers: JsonNumbers, second: list[JsonNumbers]) -> str:
    said = method_comparison(numbers, *second)
    if not said or not second:
        return said
    return (
        "<p>Equation error is a regression: it needs no search and no start value, and noise in"
        " its regressors biases it towards zero. It is shown for comparison and has no verdict"
        " (<code>--method</code> chooses others).</p>" + said
    )


def _folded(title: str, content: str) -> str:
    """Return what is looked at on demand: closed on the screen, and not printed unless opened."""
    if not content:
        return ""
    return f"<details><summary>{title}</summary>{content}</details>"


def _pair(parts: Iterable[str]) -> str:
    return f'<div class="pair">{"".join(f"<div>{part}</div>" for part in parts if part)}</div>'


def _data_lines(flights: Sequence[ShownFlight]) -> str:
    """Return a line a log: how long, whether all of it is there."""
    said = []
    for flight in flights:
        lost = len(flight.summary["losses"]["ranges"])
        losses = f"{lost} lost range{'s' * (lost > 1)}" if lost else "nothing lost"
        line = f"{flight.name}: {flight.summary['duration_s']:.0f} s, {losses}"
        said.append(f'<p class="facts">{escaped(line)}</p>')
    return "".join(said)


def _reasons(found: Identification) -> str:
    return f"<pre>{escaped_lines([*found.verdict, *found.opinion_lines])}</pre>"


def _findings(found: Identification) -> str:
    said = [*(finding.line for finding in found.findings), *found.notes]
    return "<h3>Findings and notes</h3>" + items(said) if said else ""


def _overview(flights: Sequence[ShownFlight]) -> str:
    parts = []
    for flight in flights:
        text = f"{flight.name}: test points shaded by their grade"
        parts.append(picture(overview_figure(flight), text))
        track = track_figure(flight)
        if track is not None:
            parts.append(picture(track, f"{flight.name}: track from above, numbered by test point"))
    return _pair(parts)


def _pictures(figures: Mapping[str, Any], captions: Mapping[str, str]) -> str:
    return "".join(
        picture(figures[name], text) for name, text in captions.items() if name in figures
    )


def _fit_picture(
    found: Identification, figures: Mapping[str, Any], at: int, label: str, title: str
) -> str:
    if at < len(found.linear):
        answer = found.linear[at]
        return picture(model_histories(answer), f"{title}: {caption(answer)}")
    return _pictures(figures, {"coefficients_fit": f"{title}: measured and model"})


def _estimates(found: Identification, numbers: JsonNumbers, at: int, label: str, title: str) -> str:
    causes: dict[str, str] = {}
    if label in found.table.index:
        widest = found.table.loc[label]["widened_by"]
        causes = {str(name): str(cause) for name, cause in widest.items()}
    said = parameter_tables(numbers, at, label, causes)
    if found.prior is not None and numbers.document["answers"][at].get("coefficients"):
        said += items(f"prior: {line}" for line in found.prior.source if line)
    return f"<h3>{escaped(title)}</h3>{said}"


def _appendix(parts: ReportParts, documents: Mapping[str, str]) -> str:
    """Return command, versions, hashes and the numbers themselves, each document a file to save."""
    saved = " ".join(
        f'<a download="{name}.json" id="{name}" href="data:application/json;base64,'
        f'{base64.b64encode(text.encode("utf-8")).decode("ascii")}">{name}.json</a>'
        for name, text in documents.items()
    )
    rows = [[escaped(name), escaped(value)] for name, value in parts.versions.items()]
    files = [
        [escaped(name), f"<code>{escaped(value)}</code>"] for name, value in parts.hashes.items()
    ]
    return (
        f"<h3>Command</h3><pre>{escaped(parts.command)}</pre>"
        f"<h3>Versions</h3>{table(['what', 'version'], rows, (0, 1))}"
        f"<h3>Files</h3>{table(['file', 'SHA-256'], files, (0, 1))}"
        f"<h3>Numbers</h3><p>{saved}: all numbers of this page, as"
        " <code>host identify --json</code> prints them.</p>"
    )
