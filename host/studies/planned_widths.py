"""What `host plan` promises beside what flights of that card achieve, through the recorder.

One row a coefficient and flight goes to a file that a later run continues.
"""

from __future__ import annotations

import functools
import itertools
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from host.planning.card_design import design
from host.planning.predicted_widths import predict_widths
from host.readers.even_grid import even_columns
from host.sysid.answer import true_coefficients
from host.sysid.pipeline import at_hand, identify_columns
from host.twin.testcard.cards import Card, load
from host.twin.virtual import virtual_flight

from studies.demonstration import PRINCIPAL
from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED = 31_200
KEPT = 1.5  # times the promise, or one over it
COLUMNS = ("cell", "seed", "name", "true", "estimate", "half_width", "promised")


def cells() -> dict[str, Card]:
    """Return the cards: one of ours, and designed ones for two aircraft."""
    kadet = design("kadetlt40")
    return {
        "demo, 0.3 m/s": load("demo"),
        "designed, ultrastick25e, 0.3 m/s": _in_gusts(design("ultrastick25e"), 0.3),
        "designed, kadetlt40, 0.6 m/s": _in_gusts(kadet, 0.6),
    }


def _in_gusts(card: Card, gusts_mps: float) -> Card:
    return replace(card, air=replace(card.air, turbulence_mps=gusts_mps))


def rows_of(
    cell: str, card: Card, seed: int, promised: dict[str, float]
) -> list[dict[str, object]]:
    """Fly and identify as the verbs do; the principal derivatives of both axes."""
    flight = virtual_flight(card, seed)
    columns, _ = even_columns(flight.table)
    answers = identify_columns(at_hand(columns, aircraft=card.aircraft)).linear
    rows: list[dict[str, object]] = []
    for answer in answers:
        truth = true_coefficients({"maneuver": list(flight.maneuvers)}, answer.template)
        for c in answer.coefficients:
            if c.name in PRINCIPAL:
                values = (cell, seed, c.name, truth[c.name], c.value, c.half_width)
                rows.append(dict(zip(COLUMNS, (*values, promised[c.name]), strict=True)))
    return rows


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line a cell, then what all come to."""
    lines = ["cell                                 promised % achieved %  kept of       holds of"]
    groups = {cell: [r for r in rows if r["cell"] == cell] for cell in {r["cell"] for r in rows}}
    for cell, own in (*sorted(groups.items()), ("all", list(rows))):
        truth, value, half, promised = (
            np.array([float(r[k]) for r in own])
            for k in ("true", "estimate", "half_width", "promised")
        )
        kept = (half < KEPT * promised) & (half > promised / KEPT)
        held = np.abs(value - truth) <= promised
        widths = (100.0 * np.median(x / np.abs(truth)) for x in (promised, half))
        lines.append(
            f"{cell:35s}  {next(widths):9.1f} {next(widths):10.1f}  {np.sum(kept):4d} {len(own):4d}"
            f" ({100.0 * np.mean(kept):4.1f} %)  {np.sum(held):4d} ({100.0 * np.mean(held):4.1f} %)"
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
