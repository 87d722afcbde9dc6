"""What `host plan` promises against what flights of that card achieve, through the recorder.

One row a coefficient, flight and estimator goes to a file that a later run continues. And
where a half-width is what `host live` calls enough, is the coefficient trusted at home?
"""

from __future__ import annotations

import functools
import itertools
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from host.aircraft.file import load as load_aircraft
from host.constants import TRUST_SHARE
from host.errors import IdentificationError
from host.planning.card_design import design
from host.planning.optimal_card import optimal_card
from host.planning.predicted_widths import predict_widths
from host.readers.even_grid import even_columns
from host.sysid.pipeline import at_hand, identify_columns
from host.twin.testcard.cards import Card, load
from host.twin.virtual import virtual_flight

from studies.demonstration import PRINCIPAL
from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED = 31_200
DEFAULT, COEFFICIENTS = "default", "coefficients"
TRUSTED, MISSING = "trust", "missing"
COLUMNS = (
    "cell", "seed", "model", "name", "true", "estimate", "half_width", "mark", "promised",
)  # fmt: skip


def cells() -> dict[str, Card]:
    """Return the cards: one of ours, designed ones for two aircraft, an optimal one."""
    kadet = design("kadetlt40")
    optimal = optimal_card(load_aircraft("ultrastick25e")).card
    return {
        "demo, 0.3 m/s": load("demo"),
        "designed, ultrastick25e, 0.3 m/s": _in_gusts(design("ultrastick25e"), 0.3),
        "designed, kadetlt40, 0.6 m/s": _in_gusts(kadet, 0.6),
        "optimal, ultrastick25e, calm": _in_gusts(optimal, 0.0),
        "optimal, ultrastick25e, 0.3 m/s": _in_gusts(optimal, 0.3),
    }


def _in_gusts(card: Card, gusts_mps: float) -> Card:
    return replace(card, air=replace(card.air, turbulence_mps=gusts_mps))


def rows_of(
    cell: str, card: Card, seed: int, promised: dict[str, float]
) -> list[dict[str, object]]:
    """Fly through the recorder; principal coefficients of both estimators, missing ones too."""
    flight = virtual_flight(card, seed)
    columns, _ = even_columns(flight.table)
    truth = {"first_row_s": 0.0, "maneuver": list(flight.maneuvers)}
    rows: list[dict[str, object]] = []
    for model in (DEFAULT, COEFFICIENTS):
        found: dict[str, tuple[Any, ...]] = {}
        try:
            answer = identify_columns(
                at_hand(columns, aircraft=card.aircraft),
                models=None if model == DEFAULT else model,
                truth=truth,
            )
            marks = answer.table["verdict"].to_dict()
            for of, compared in answer.document()["truth"].items():
                for name, own in compared.items():
                    values = (own["truth"], own["value"], own["half_width"], marks.get((of, name)))
                    found[name] = values
        except IdentificationError:
            pass
        for name in PRINCIPAL:
            values = found.get(name, (np.nan, np.nan, np.inf, MISSING))
            row = (cell, seed, model, name, *values, promised.get(name, np.nan))
            rows.append(dict(zip(COLUMNS, row, strict=True)))
    return rows


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line a cell and estimator: widths, what they hold, what is enough and trusted."""
    lines = [
        "| card | model | promised % | achieved % | over promised, 90 % of them | holds | trust"
        " | enough | enough, not trust |",
        "| --- " * 9 + "|",
    ]
    places = dict.fromkeys((r["cell"], r["model"]) for r in rows)
    for cell, model in places:
        own = [r for r in rows if (r["cell"], r["model"]) == (cell, model)]
        truth, value, half, promised = (
            np.array([float(r[k]) for r in own])
            for k in ("true", "estimate", "half_width", "promised")
        )
        trusted = np.array([r["mark"] == TRUSTED for r in own])
        enough = half <= TRUST_SHARE * np.abs(value)
        known = np.isfinite(value)
        held = int(np.sum(np.abs(value - truth)[known] <= half[known]))
        by_plan, by_flight = (100.0 * np.nanmedian(x / np.abs(truth)) for x in (promised, half))
        over = np.percentile(half / promised, 90.0)
        lines.append(
            f"| {cell} | {model} | {by_plan:.1f} | {by_flight:.1f} | {over:.2f} | {held} of"
            f" {len(own)} | {np.sum(trusted)} | {np.sum(enough)} | {np.sum(enough & ~trusted)} |"
        )
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run(
        "planned_widths", __doc__, arguments, flights=10, first_seed=FIRST_SEED, each="of each cell"
    )
    cards = cells()

    @functools.cache
    def promised(cell: str) -> dict[str, float]:
        return {w.name: w.half_width for w in predict_widths(cards[cell]).widths}

    def fly(cell: str, seed: int) -> list[dict[str, object]]:
        return rows_of(cell, cards[cell], seed, promised(cell))

    rows = flown_rows(run.rows, COLUMNS, itertools.product(cards, run.seeds), fly)
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
