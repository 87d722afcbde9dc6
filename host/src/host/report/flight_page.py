"""The page of a flight: strips, test points, track, events and losses in one file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from host.chart_library import chart_script, chart_style
from host.constants import DEG_PER_RAD
from host.report.channel_list import Channel, channels_of
from host.report.ground_track import ground_track
from host.report.html_page import HtmlPage
from host.report.html_text import escaped, script_data
from host.report.page_data import PageData, page_data
from host.report.shown_flight import Happening, ShownFlight, is_simulated, quality
from host.report.strip_list import strips_of
from host.sysid.maneuvers import DetectedManeuver, Grade

_MODULES = ("unpack", "samples", "strips", "track", "spectrum", "panels", "main")
_LISTED = 200  # events and losses


def flight_page(flight: ShownFlight, *, full: bool = False) -> str:
    """Return the page of a flight as text.

    Parameters
    ----------
    flight : ShownFlight
    full : bool
        Every sample, whatever the size.

    Raises
    ------
    UsageError
        If uPlot is not installed.
    """
    channels = channels_of(flight)
    data = page_data(flight, channels, full=full)
    meta = _meta(flight, channels, data)
    blocks = {"meta": script_data(meta), "overview": data.overview.body}
    blocks |= {f"stretch{k}": one.body for k, one in enumerate(data.stretches)}
    return HtmlPage(
        title=f"{flight.name}: flight",
        body=_body(flight, data, track=meta["track"] is not None),
        style=chart_style() + page_text("page.css"),
        script=chart_script() + page_script(),
        data=blocks,
    ).text()


def page_text(name: str) -> str:
    """Return a file of the folder ``page``."""
    return (Path(__file__).parent / "page" / name).read_text(encoding="utf-8")


def page_script() -> str:
    """Return our own modules as one script without global names."""
    own = "\n".join(page_text(f"{name}.js") for name in _MODULES)
    return f"\n(() => {{\n'use strict';\n{own}\n}})();\n"


def _meta(flight: ShownFlight, channels: list[Channel], data: PageData) -> dict[str, Any]:
    names = {one.name for one in channels}
    return {
        "channels": [
            {"name": one.name, "unit": one.unit, "text": one.text, "group": one.group}
            for one in channels
        ],
        "strips": [
            {"name": one.name, "channels": one.channels, "on": one.on} for one in strips_of(names)
        ],
        "overview": data.overview.head,
        "stretches": [one.head for one in data.stretches],
        "whole": data.whole,
        "maneuvers": [
            {"number": number, "start_s": item.start_s, "end_s": item.end_s,
             "grade": mark.score, "quality": quality(mark.score)}
            for number, (item, mark) in enumerate(flight.maneuvers, start=1)
        ],
        "events": [{"t_s": one.t_s} for one in flight.events[:_LISTED]],
        "losses": [{"t_s": one.t_s, "end_s": one.end_s} for one in flight.losses[:_LISTED]],
        "jumps": [{"t_s": one.t_s, "channel": one.channel} for one in flight.jumps],
        "track": ground_track(flight),
    }  # fmt: skip


def _body(flight: ShownFlight, data: PageData, *, track: bool) -> str:
    return "\n".join(
        [
            f"<h1>{escaped(flight.name)}</h1>",
            *(f'<p class="facts">{escaped(line)}</p>' for line in _facts(flight.summary)),
            *(f'<p class="warning">{escaped(one)}</p>' for one in _doubts(flight, data)),
            '<p id="trouble" class="warning"></p>',
            '<div class="columns"><main>',
            _controls(),
            '<div id="strips"></div>',
            _panels(),
            "</main><aside>",
            "<h2>Test points</h2>",
            maneuver_table(flight.maneuvers, flight.shares),
            _way(track),
            _jumps(flight),
            _happenings("Events", flight.events),
            _happenings("Losses", flight.losses, _untimed(flight.summary)),
            "</aside></div>",
            "<details><summary>All that host decode says</summary><pre>"
            + "\n".join(map(escaped, flight.lines))
            + "</pre></details>",
        ]
    )


def _facts(summary: Mapping[str, Any]) -> list[str]:
    rate = f", {summary['rows']} rows" if "rows" in summary else ""
    kind = summary.get("format") or "flight log"
    end = summary["complete"].replace("not proven", "its end is not proven")
    first = f"{kind}, {end}: {summary['duration_s']:.1f} s{rate}"
    aircraft = {one["aircraft"] for one in summary.get("sessions", ()) if one.get("aircraft")}
    first += f"; aircraft {', '.join(sorted(aircraft))}" if aircraft else ""
    return [first + ("; simulated: not flown" if is_simulated(summary) else "")]


def _doubts(flight: ShownFlight, data: PageData) -> list[str]:
    losses = flight.summary["losses"]
    lost = len(losses["ranges"])
    said = []
    if lost:
        ranges = (
            "1 lost range: shown as a gap" if lost == 1 else f"{lost} lost ranges: shown as gaps"
        )
        said.append(f"{ranges} where it is known when, listed under Losses.")
    names = (flight.summary.get("calibration") or {}).get("default_columns") or []
    if names:
        said.append(f"Default calibration, not this instrument's own, under: {', '.join(names)}.")
    if flight.shares:
        said.append("Surfaces are commanded shares of full travel, not angles.")
    return [*said, *(note[0].upper() + note[1:] for note in flight.notes), *data.remarks]


def _controls() -> str:
    buttons = (("all", "all", "the whole flight"), ("back", "\u2190", "earlier"),
               ("on", "\u2192", "later"), ("in", "+", "closer"),
               ("out", "\u2212", "wider"))  # fmt: skip
    made = "".join(f'<button id="go-{i}" title="{w}">{t}</button>' for i, t, w in buttons)
    return (
        f'<div class="bar">{made}<span id="view"></span></div>'
        '<details><summary>Channels</summary><div id="picker"></div></details>'
    )


def _panels() -> str:
    return (
        '<details class="panel" id="xy-panel"><summary>X-Y</summary><p>of what is in view:'
        ' <select id="xy-y"></select> over <select id="xy-x"></select></p>'
        '<div id="xy"></div></details>'
        '<details class="panel" id="spectrum-panel"><summary>Spectrum</summary><p>of what is in'
        ' view: <select id="spectrum-channel"></select> <span id="spectrum-note"></span></p>'
        '<div id="spectrum"></div></details>'
    )


def maneuver_table(
    maneuvers: list[tuple[DetectedManeuver, Grade]], shares: tuple[str, ...] = ()
) -> str:
    """Return the test points with their grades as a table; a row knows its time."""
    if not maneuvers:
        return "<p>none found</p>"
    rows = "".join(
        f'<tr data-from="{item.start_s:.3f}" data-to="{item.end_s:.3f}">'
        f'<td class="number">{number}</td><td class="number">{item.start_s:.1f} s</td>'
        f"<td>{escaped(item.axis.split('_')[0])} {escaped(item.kind)}</td>"
        f'<td class="number">{_amplitude(item, shares)}</td>'
        f'<td class="number {quality(mark.score)}">{mark.score:.2f}</td></tr>'
        + (f"<tr><td></td><td colspan=4>{escaped('; '.join(mark.remarks))}</td></tr>"
           if mark.remarks else "")
        for number, (item, mark) in enumerate(maneuvers, start=1)
    )  # fmt: skip
    return (
        '<div class="list"><table><tr><th class="number">no.</th><th class="number">at</th>'
        '<th>input</th><th class="number">size</th><th class="number">grade</th></tr>'
        f"{rows}</table></div>"
    )


def _amplitude(item: DetectedManeuver, shares: tuple[str, ...]) -> str:
    if item.axis == "throttle" or item.axis.removesuffix("_rad") in shares:
        return f"{item.amplitude:.0%}"
    return f"{item.amplitude * DEG_PER_RAD:.1f}\u00b0"


def _way(track: bool) -> str:
    if not track:
        return "<h2>Track</h2><p>no GPS fix</p>"
    return '<h2>Track</h2><canvas id="track"></canvas><p>numbers: test points</p>'


def _jumps(flight: ShownFlight) -> str:
    if "servo_elevator_us" not in flight.columns:
        return ""
    counts: dict[str, int] = {}
    for one in flight.jumps:
        counts[one.channel] = counts.get(one.channel, 0) + 1
    said = ", ".join(f"{channel} {count}" for channel, count in counts.items()) or "none"
    return f"<h2>Servo jumps without stick</h2><p>{escaped(said)}</p>"


def _untimed(summary: Mapping[str, Any]) -> list[str]:
    """Return the losses whose time is unknown."""
    return [one["text"] for one in summary["losses"]["ranges"] if one.get("t_s") is None]


def _happenings(title: str, found: list[Happening], untimed: list[str] | None = None) -> str:
    if not found and not untimed:
        return f"<h2>{title}</h2><p>none</p>"
    rows = "".join(
        f'<tr data-from="{one.t_s:.3f}" data-to="{one.end_s:.3f}">'
        f'<td class="number">{one.t_s:.2f} s</td><td>{escaped(one.text)}</td></tr>'
        for one in found[:_LISTED]
    )
    rows += "".join(
        f"<tr><td></td><td>{escaped(text)}</td></tr>" for text in (untimed or [])[:_LISTED]
    )
    more = f"<p>... and {len(found) - _LISTED} more</p>" if len(found) > _LISTED else ""
    return f'<h2>{title}</h2><div class="list"><table>{rows}</table></div>{more}'
