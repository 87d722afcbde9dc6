"""Sections of a report about the flight: health of the data, maneuvers, sensors, calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from host.constants import DEG_PER_RAD
from host.people_units import people_name
from host.report.html_table import items, table
from host.report.html_text import escaped
from host.report.json_numbers import JsonNumbers
from host.report.shown_flight import ShownFlight, quality


def data_health(flights: list[ShownFlight], sources: list[str]) -> str:
    """Return the summary of `host decode` for each log, and a remark for each other source."""
    shown = {flight.name for flight in flights}
    parts = [
        f"<h3>{escaped(flight.name)}</h3><pre>{escaped_lines(flight.lines)}</pre>"
        for flight in flights
    ]
    tables = [name for name in sources if name.rsplit("/", 1)[-1] not in shown]
    if len(flights) < len(sources):
        parts.append(
            f"<p>{escaped(', '.join(tables) or 'a table')}: a table, not a log: nothing is known of"
            " what its recorder lost.</p>"
        )
    return "".join(parts)


def escaped_lines(lines: list[str]) -> str:
    """Return lines for a ``<pre>``."""
    return "\n".join(map(escaped, lines))


def maneuver_cards(flights: list[ShownFlight], answers: list[dict[str, Any]]) -> str:
    """Return every maneuver with its grade, and which models used it or kept it unseen."""
    rows = []
    for number, flight in enumerate(flights, start=1):
        for k, (item, mark) in enumerate(flight.maneuvers, start=1):
            share = item.axis == "throttle" or item.axis.removesuffix("_rad") in flight.shares
            size = f"{item.amplitude:.0%}" if share else f"{item.amplitude * DEG_PER_RAD:.1f} deg"
            grade = f'<span class="{quality(mark.score)}">{mark.score:.2f}</span>'
            rows.append([
                f"{number}.{k}" if len(flights) > 1 else f"{k}",
                f"{item.start_s:.1f}", escaped(f"{item.axis.split('_')[0]} {item.kind}"),
                f"{item.input_end_s - item.start_s:.1f}", size,
                f"{mark.response_over_noise:.0f}", f"{mark.trim_quiet:.0%}", f"{mark.feedback:.0%}",
                grade, escaped(_use(item, answers)), escaped("; ".join(mark.remarks)),
            ])  # fmt: skip
    heads = ["no.", "at, s", "input", "lasts, s", "size", "response/noise", "unrest before",
             "pilot after", "grade", "used by", "remarks"]  # fmt: skip
    return table(heads, rows, (2, 9, 10))


def _use(item: Any, answers: list[dict[str, Any]]) -> str:
    """Return which models fitted a maneuver, and which kept it to be predicted."""
    name = f"{item.kind} on {item.axis.split('_')[0]} at {item.start_s:.1f} s"
    fitted = [a["template"] for a in answers if any(name in m for m in a["maneuvers"])]
    held_out_in = [a["template"] for a in answers if any(name in m for m in a.get("held_out", ()))]
    said = [", ".join(dict.fromkeys(fitted))] if fitted else []
    said += [f"unseen: {', '.join(dict.fromkeys(held_out_in))}"] if held_out_in else []
    return "; ".join(said)


def sensor_agreement(numbers: JsonNumbers) -> str:
    """Return the data-compatibility check: sensor errors found, residuals, doubts."""
    found = numbers.document["data_compatibility"]
    many = isinstance(found, list)
    parts = []
    for k, one in enumerate(found if many else [found]):
        root: tuple[str | int, ...] = ("data_compatibility", k) if many else ("data_compatibility",)
        if not one:
            parts.append("<p>not checked: too few sensors, or no stretch long enough</p>")
            continue
        rows = []
        for name, own in one["findings"].items():
            called, scale = people_name(name)
            place = (*root, "findings", name)
            rows.append([
                escaped(called), numbers.html(*place, "value", scale=scale),
                numbers.html(*place, "half_width", digits=2, scale=scale),
                numbers.html(*place, "calibration_half_width", digits=2, scale=scale),
                escaped("taken out" if own["told"] else own["reason"]),
            ])  # fmt: skip
        heads = ["error", "found", "95 % \u00b1", "calibration's \u00b1", "what became of it"]
        parts.append(table(heads, rows, (0, 4)))
        rms = []
        for name in one["residual_rms"]:
            called, scale = people_name(name)
            number = numbers.html(*root, "residual_rms", name, digits=3, scale=scale)
            rms.append([escaped(called), number])
        parts.append("<h4>left between sensors</h4>" + table(["signal", "rms"], rms))
    return "".join(parts)


def calibration_and_preflight(
    flights: list[ShownFlight], calibration: Mapping[str, str], sheet: tuple[str, list[str]] | None
) -> str:
    """Return names and dates of calibrations, columns that rest on none, the preflight sheet."""
    rows = []
    for flight in flights:
        own = flight.summary.get("calibration") or {}
        rows.append([
            escaped(flight.name), escaped(own.get("name") or ""), escaped(own.get("date") or ""),
            escaped(", ".join(own.get("default_columns") or []) or "none"),
        ])  # fmt: skip
    said = table(["flight", "calibration", "date", "columns on default numbers"], rows,
                 (0, 1, 2, 3))  # fmt: skip
    if calibration:
        said += items(f"{name}: SHA-256 {digest}" for name, digest in calibration.items())
    if sheet is None:
        return said + "<p>No preflight sheet was given (--preflight FILE).</p>"
    title, lines = sheet
    return said + f"<h4>{escaped(title)}</h4><pre>{escaped_lines(lines)}</pre>"
