"""Flights whose next point is replanned from what is known, against the standard card.

Both are flown by the same hand in the same air with the same instrument, and estimated from the
radio as `host live` does after each completed test point, until all wanted half-widths are reached.
A row a flight and way goes to a file that a later run continues.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

from host.aircraft.linear_aircraft import load
from host.live.estimates.flight_estimate import FlightEstimate, FlightEstimator
from host.planning.card_design import design
from host.planning.next_point import NextPoints, in_words
from host.planning.optimal_card import standard_card
from host.planning.point_widths import test_points
from host.planning.wanted_widths import WANTED_PERCENT
from host.twin.testcard.cards import Card, Pilot, Segment, length_s

from studies.radio_flights import RadioFlight, after_each_point, radio_flight
from studies.stored_rows import flown_rows, seeded_run
from studies.while_flying import BEHIND_S

AIRCRAFT = "ultrastick25e"
FIRST_SEED, FLIGHTS = 10950, 20
GUSTS_MPS = 0.5
MOST_POINTS = 16
WAYS = ("replanned", "3-2-1-1", "designed")
TRIM = Segment("trim", duration_s=3.0)
COLUMNS = ("seed", "way", "points", "seconds", "reached", "flown")


@cache
def next_points() -> NextPoints:
    """Return who chooses."""
    return NextPoints(load(AIRCRAFT))


@cache
def standard(way: str) -> tuple[Segment, ...]:
    """Return the test points of a card that knows nothing of the flight, in turn."""
    if way == "designed":
        points = test_points(design(AIRCRAFT))
    else:
        points = [replace(s, before_s=3.0) for s in standard_card(load(AIRCRAFT)).segments[1:-1]]
    return tuple((points * MOST_POINTS)[:MOST_POINTS])


def card_of(points: Sequence[Segment]) -> Card:
    """Return a card of these test points, by a pilot's hand, in gusts."""
    card = design(AIRCRAFT)
    air = replace(card.air, turbulence_mps=GUSTS_MPS)
    segments = (TRIM, *points, TRIM)
    return replace(card, segments=segments, air=air, pilot=Pilot())


def reached(found: FlightEstimate) -> bool:
    """Return whether every wanted half-width is."""
    return all(
        name in found.known and found.known[name].percent <= percent
        for name, percent in WANTED_PERCENT.items()
    )


def rows_of(seed: int, way: str) -> Iterator[dict[str, object]]:
    """Fly one way until the wanted half-widths are reached."""
    with tempfile.TemporaryDirectory() as place:
        if way == "replanned":
            points, done = _replanned(seed, Path(place))
        else:
            flight = radio_flight(card_of(standard(way)), seed)
            every = _estimates(flight, Path(place))
            count = next((n for n, one in enumerate(every, 1) if reached(one)), None)
            points, done = list(standard(way)[: count or MOST_POINTS]), count is not None
    card = card_of(points)
    yield {
        "seed": seed,
        "way": way,
        "points": len(points),
        "seconds": f"{sum(length_s(card, s) for s in card.segments[:-1]):.1f}",
        "reached": int(done),
        "flown": "; ".join(in_words(s) for s in points),
    }


def _replanned(seed: int, folder: Path) -> tuple[list[Segment], bool]:
    """Return the points that were chosen one after the other.

    Each is flown behind those before it: gusts, hand and instrument of a seed are the same.
    """
    first = next_points().best({}, (), WANTED_PERCENT)
    points = [first.segment] if first else []
    while True:
        *_, found = _estimates(radio_flight(card_of(points), seed), folder, last=True)
        if reached(found):
            return points, True
        chosen = next_points().best(found.known, found.flown, WANTED_PERCENT)
        if chosen is None or len(points) == MOST_POINTS:
            return points, False
        points.append(chosen.segment)


def _estimates(
    flight: RadioFlight, folder: Path, *, last: bool = False
) -> Iterator[FlightEstimate]:
    """Yield the estimates on the page after each test point, or after the last alone."""
    (folder / "calibration.toml").write_text(flight.calibration, encoding="utf-8")
    by = FlightEstimator(AIRCRAFT, folder / "calibration.toml")
    received = list(after_each_point(flight.sent, flight.truth, BEHIND_S))
    for data in received[-1:] if last else received:
        (folder / "live.radio").write_bytes(data)
        yield by.at(folder / "live.radio")


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return the time of each way, and the ratio to the better standard card."""
    lines = ["way         reached   points   seconds: median, most"]
    seconds = {(r["way"], r["seed"]): float(r["seconds"]) for r in rows}
    medians = {}
    for way in WAYS:
        own = [r for r in rows if r["way"] == way]
        if not own:
            return lines
        times = [float(r["seconds"]) for r in own]
        medians[way] = statistics.median(times)
        done = sum(r["reached"] == "1" for r in own)
        points = statistics.median(int(r["points"]) for r in own)
        lines.append(f"{way:10s}  {done:2d} of {len(own):2d}  {points:7.1f}   {medians[way]:.1f},"
                     f" {max(times):.1f}")  # fmt: skip
    best = min(WAYS[1:], key=medians.__getitem__)
    seeds = sorted({r["seed"] for r in rows})
    ratios = [seconds["replanned", s] / seconds[best, s] for s in seeds]
    lines.append(
        f"replanned over {best}, of each flight: median {statistics.median(ratios):.2f},"
        f" {min(ratios):.2f} to {max(ratios):.2f}; at most 0.8 in"
        f" {sum(x <= 0.8 for x in ratios)} of {len(ratios)}"
    )
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run("replanning", __doc__, arguments, flights=FLIGHTS, first_seed=FIRST_SEED)
    keys = [(seed, way) for seed in run.seeds for way in WAYS]
    rows = flown_rows(run.rows, COLUMNS, keys, lambda seed, way: list(rows_of(seed, way)))
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
