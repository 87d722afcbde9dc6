"""The optimal card, the standard one flown by the logger, and a pilot's hand, on drawn aircraft.

One row a coefficient, card and flight goes to a file that a later run continues.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from host.aircraft.file import load
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.planning.optimal_card import optimal_card, standard_card
from host.planning.prior_range import random_aircraft
from host.sysid.answer import true_coefficients
from host.sysid.pipeline import identify
from host.twin.testcard.cards import BEFORE_S, Card, Pilot, Segment, duration_s
from host.twin.virtual import virtual_flight

from studies.demonstration import PRINCIPAL
from studies.stored_rows import flown_rows, seeded_run

AIRCRAFT = "ultrastick25e"
FIRST_SEED = 23_100
GUSTS_MPS = 0.5
WANTED, USABLE = 0.10, 0.25  # of the value: by noise and gusts; by everything
STANDARD_ROUNDS, OPTIMAL_POINTS = 3, 4  # about a minute each
HAND, LOGGER, OPTIMAL = "3-2-1-1, a pilot's hand", "3-2-1-1, the logger", "optimal, the logger"
COLUMNS = ("card", "seed", "name", "true", "estimate", "half_width", "noise_half_width", "flight_s")
MISSED = "none"  # name in a row of a flight that gave no answer


@cache
def cards() -> dict[str, Card]:
    """Return the three cards, in the same gusts and about equally long."""
    aircraft = load(AIRCRAFT)
    standard = standard_card(aircraft, repeat=STANDARD_ROUNDS)
    best = optimal_card(aircraft, gusts_mps=GUSTS_MPS).card
    points = [best.segments[0], *[best.segments[1]] * OPTIMAL_POINTS, best.segments[-1]]
    found = {
        HAND: replace(standard, segments=tuple(_at_leisure(s) for s in standard.segments)),
        LOGGER: standard,
        OPTIMAL: replace(best, segments=tuple(points)),
    }
    return {
        name: replace(card, air=replace(card.air, turbulence_mps=GUSTS_MPS))
        for name, card in found.items()
    }


def _at_leisure(point: Segment) -> Segment:
    """Return an input behind the time a pilot takes to trim."""
    return replace(point, before_s=BEFORE_S) if point.axes else point


def hand_of(seed: int) -> Pilot:
    """Return a pilot whose faults are drawn: late and unequal steps, broken off, corrected."""
    rng = np.random.default_rng([seed, 6])
    timing, amplitude, drift, early, breaks = rng.uniform(
        (0.02, 0.05, 0.03, 0.0, 0.0), (0.08, 0.20, 0.15, 0.3, 0.2)
    ).tolist()
    return Pilot(timing_s=timing, amplitude=amplitude, drift=drift, early=early, breaks_off=breaks)


def rows_of(name: str, seed: int) -> list[dict[str, object]]:
    """Fly one card with one drawn aircraft, and identify it as the verb does."""
    card = cards()[name]
    card = replace(card, pilot=hand_of(seed)) if name == HAND else card
    flight = virtual_flight(card, seed, chain="gps", aircraft=random_aircraft(load(AIRCRAFT), seed))
    flown_s = round(duration_s(card) - card.flight.ground_s, 1)
    try:
        answers = identify(flight.table, aircraft=AIRCRAFT).linear
    except IdentificationError:
        answers = ()
    rows: list[dict[str, object]] = []
    for answer in answers:
        truth = true_coefficients({"maneuver": list(flight.maneuvers)}, answer.template)
        for c in answer.coefficients:
            if c.name in PRINCIPAL:
                noise = NORMAL_95 * c.fit_error
                values = (name, seed, c.name, truth[c.name], c.value, c.half_width, noise, flown_s)
                rows.append(dict(zip(COLUMNS, values, strict=True)))
    if rows:
        return rows
    missed = (name, seed, MISSED, 0.0, 0.0, 0.0, 0.0, flown_s)
    return [dict(zip(COLUMNS, missed, strict=True))]


def flights(rows: Sequence[dict[str, str]]) -> dict[tuple[str, int], dict[str, float]]:
    """Return of each card and seed: seconds to the wanted half-widths, medians, usable, held."""
    found: dict[tuple[str, int], dict[str, float]] = {}
    key = lambda r: (r["card"], int(r["seed"]))  # noqa: E731
    for place, group in itertools.groupby(sorted(rows, key=key), key=key):
        own = [r for r in group if r["name"] in PRINCIPAL]
        complete = len(own) == len(PRINCIPAL)
        true, value, half, noise, flown_s = (
            np.array([float(r[k]) for r in own] or [np.nan]) for k in COLUMNS[3:]
        )
        widest = np.max(noise / np.abs(true)) if complete else np.inf
        found[place] = {
            "seconds": float(flown_s[0] * (widest / WANTED) ** 2) if complete else np.inf,
            "half": float(np.median(half / np.abs(true))),
            "noise": float(np.median(noise / np.abs(true))),
            "usable": float(complete and np.max(half / np.abs(true)) <= USABLE),
            "held": float(np.mean(np.abs(value - true) <= half)),
        }
    return found


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line a card, then the ratios of times on the same aircraft."""
    found = flights(rows)
    names = [name for name in (HAND, LOGGER, OPTIMAL) if any(c == name for c, _ in found)]
    lines = ["card                       flights  minutes to 10 %  half-width %  by noise %  usable"
             "  held %"]  # fmt: skip
    for name in names:
        own = [v for (c, _), v in found.items() if c == name]
        minutes = float(np.median([v["seconds"] for v in own])) / 60.0
        half, noise, held = (
            100.0 * np.nanmedian([v[k] for v in own]) for k in ("half", "noise", "held")
        )
        share = sum(v["usable"] for v in own)
        lines.append(
            f"{name:26s} {len(own):7d}  {minutes:15.2f}  {half:12.1f}  {noise:10.1f}"
            f"  {share:3.0f} of {len(own)}  {held:5.1f}"
        )
    for name, other in ((OPTIMAL, LOGGER), (OPTIMAL, HAND), (LOGGER, HAND)):
        both = {s for c, s in found if c == name} & {s for c, s in found if c == other}
        ratios = [found[name, s]["seconds"] / found[other, s]["seconds"] for s in sorted(both)]
        if ratios:
            low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
            lines.append(
                f"time of '{name}' over '{other}', {len(ratios)} aircraft:"
                f" median {middle:.2f}, quartiles {low:.2f} and {high:.2f}"
            )
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run(
        "optimal_cards",
        __doc__,
        arguments,
        flights=30,
        first_seed=FIRST_SEED,
        each="drawn aircraft",
    )
    keys = [(name, seed) for seed in run.seeds for name in (OPTIMAL, LOGGER, HAND)]
    rows = flown_rows(run.rows, COLUMNS, keys, rows_of)
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
