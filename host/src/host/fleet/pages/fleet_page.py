"""A type as one page to mail: nothing in it runs, nothing is asked of any host."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from host.fleet.flight_task import IDENTIFIED
from host.fleet.pages.aircraft_changes import AircraftHistory, change_lines
from host.fleet.pages.fleet_figures import drift_figure, funnel_figure
from host.fleet.pages.type_text import condition_text, half, spread
from host.fleet.pages.what_to_fly import advice_lines
from host.fleet.statistics.type_model import DIFFERS, TypeModel
from host.report.embedded_picture import picture
from host.report.flight_page import page_text
from host.report.html_page import HtmlPage
from host.report.html_table import items, table
from host.report.html_text import escaped

if TYPE_CHECKING:
    import pandas as pd

_PAIRS = """\
.pairs figure { display: inline-block; width: 48%; vertical-align: top; margin: 1%; }
@media (max-width: 40em) { .pairs figure { width: 98%; } }
"""
_MOST_ASIDE = 200  # rows of a table that somebody reads


def fleet_page(model: TypeModel, found: list[AircraftHistory], rows: pd.DataFrame) -> str:
    """Return the page of a type.

    Parameters
    ----------
    model : TypeModel
    found : list of AircraftHistory
    rows : pandas.DataFrame
        Rows of all flights of the type, those set aside too.
    """
    aside = rows[rows["state"] != IDENTIFIED]
    facts = (
        f"{len(model.aircraft)} aircraft, {len(model.flights)} flights identified,"
        f" {len(aside)} set aside"
    )
    body = [
        f"<h1>{escaped(model.name)}: the type from its fleet</h1>",
        f'<p class="facts">{facts}</p>',
        f'<p class="facts">{escaped(condition_text(model))}</p>',
        f'<div class="verdict"><h2>What has changed</h2>{items(change_lines(found))}'
        f"<h2>What to fly to learn most</h2>{items(advice_lines(model))}</div>",
        _section("Mean and spreads", _effects(model)),
        _section("Every flight against the type", _funnels(model)),
        _section("Aircraft over their flights", _drifts(model, found)),
        _section("Aircraft", _aircraft(model, found)),
        _section("Flights set aside, and why", _aside(aside)),
        _section("Findings: derivatives left out, by flight", _left_out(model)),
    ]
    style = page_text("report.css") + _PAIRS
    return HtmlPage(f"{model.name}: fleet", "\n".join(body), style).text()


def _section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>{content}</section>"


def _effects(model: TypeModel) -> str:
    heads = ("derivative", "mean", "95 %", "between aircraft", "between flights", "new aircraft",
             "aircraft", "flights", "aircraft differ")  # fmt: skip
    rows = [
        (
            escaped(name),
            f"{e.mean.value:.4g}",
            f"{half(e.mean):.2g}",
            spread(e.between),
            spread(e.within),
            f"{e.new_aircraft.value:.4g} &plusmn; {half(e.new_aircraft):.2g}",
            str(e.aircraft),
            str(e.flights),
            f"p {e.differs:.2g}" if e.differs < DIFFERS else "not shown",
        )
        for name, e in model.effects.items()
    ]
    said = "<p>Spreads are standard deviations with 95 % intervals. Errors that all flights share"
    said += " are in the mean's interval and do not average out.</p>"
    if model.single_aircraft:
        names = escaped(", ".join(model.single_aircraft))
        said += f"<p>Estimated from one aircraft only: {names}.</p>"
    return table(heads, rows) + said


def _funnels(model: TypeModel) -> str:
    made = (
        picture(
            funnel_figure(model, name),
            f"{name}: each flight over its standard deviation. Lines: where 95 % should lie. Grey:"
            " a new aircraft. Blue: the mean.",
        )
        for name in model.effects
    )
    return f'<div class="pairs">{"".join(made)}</div>' if model.effects else "<p>none</p>"


def _drifts(model: TypeModel, found: list[AircraftHistory]) -> str:
    parts = []
    for one in found:
        figure = drift_figure(model, one)
        if figure is not None:
            text = f"{one.aircraft}: its flights by date, with 95 % of their own. Red: changed."
            parts.append(picture(figure, text))
    return "".join(parts) or "<p>no aircraft has three flights</p>"


def _aircraft(model: TypeModel, found: list[AircraftHistory]) -> str:
    count = Counter(f.aircraft for f in model.flights)
    rows = [
        (
            escaped(one.aircraft),
            str(count[one.aircraft]),
            str(one.judged),
            escaped(one.alarms[0].cause) if one.alarms else "no",
        )
        for one in found
    ]
    return table(("aircraft", "flights", "tested for change", "changed"), rows, (0, 3))


def _aside(aside: pd.DataFrame) -> str:
    rows = [
        (escaped(row["aircraft"]), escaped(row["source"]), escaped(row["reason"]))
        for row in aside.head(_MOST_ASIDE).to_dict("records")
    ]
    more = len(aside) - len(rows)
    said = table(("aircraft", "log", "why"), rows, (0, 1, 2))
    return said + (f"<p>and {more} more: state and reason in the dataset</p>" if more else "")


def _left_out(model: TypeModel) -> str:
    found = Counter(name for flight in model.flights for name in flight.left_out)
    return items(f"{name}: {count} flights" for name, count in sorted(found.items()))
