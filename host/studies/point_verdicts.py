"""Verdicts of test points in flight against what identification made of them.

One flight is one test point, flown through the recorder by a pilot with one drawn fault or none.
Truth: identified at 100 Hz, its half-widths beside those that `host plan --alone` promises. The
verdict: from the radio of the same flight as the firmware sends it, whole and with one envelope in
twenty lost in bursts. A row a flight and loss goes to a file that a later run continues.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from host.arrays import Array
from host.live.live_stream import LiveStream
from host.live.test_point.point_watch import PointWatch
from host.physical.calibration import calibration_of_text
from host.planning.card_planning import design
from host.planning.point_widths import (
    point_derivatives,
    promise_points,
    single_point_card,
    single_point_widths,
    test_points,
)
from host.sysid.identification_error import IdentificationError
from host.twin.flight.fly import FlightRecord
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.sitl_radio import radio
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, Segment
from host.twin.virtual import virtual_flight
from host.wire.framing import EnvelopeReader, envelope

from studies.stored_rows import flown_rows

AIRCRAFT = "ultrastick25e"
FIRST_SEED, FLIGHTS = 10700, 230
PROMISE_FLIGHTS = 11
GUSTS_MPS = 0.3
WITHIN = 1.3  # times the promise
KINDS = ("good", "late", "weak", "axis", "interrupted", "gusty")
LOST = (0.0, 0.05)
BURST = 6  # envelopes, mean
LUMP_S = 0.2
COLUMNS = ("seed", "kind", "axis", "lost", "width", "worst", "found", "good", "score", "late_s")
NEVER = 99.0  # times the promise: no answer
_OTHERS = {
    "elevator": ("aileron", "rudder"),
    "aileron": ("elevator", "rudder"),
    "rudder": ("aileron", "elevator"),
}


@cache
def points() -> tuple[Card, tuple[Segment, ...]]:
    """Return the card that `host plan` designs and its different test points."""
    card = design(AIRCRAFT)
    return card, tuple(dict.fromkeys(test_points(card)))


@cache
def promised(point: Segment) -> dict[str, float]:
    """Return the half-widths that a point alone is promised to give."""
    card, _ = points()
    [found] = promise_points(single_point_card(card, point), GUSTS_MPS, flights=PROMISE_FLIGHTS)
    return {w.name: w.half_width for w in found.widths}


def drawn(card: Card, point: Segment, kind: str, seed: int) -> Card:
    """Return the point as this pilot flies it, alone."""
    rng = np.random.default_rng([seed, 77])
    gusts, pilot = GUSTS_MPS, card.pilot
    if kind == "late":
        point = replace(point, width_s=point.width_s * rng.uniform(1.6, 3.0))
        pilot = replace(pilot, hand_s=rng.uniform(0.15, 0.35))
    elif kind == "weak":
        share = rng.uniform(0.1, 0.5)
        point = replace(point, amplitudes=tuple(a * share for a in point.amplitudes))
    elif kind == "axis":
        point = replace(point, axes=(_OTHERS[point.axes[0]][rng.integers(2)],))
    elif kind == "interrupted":
        pilot = replace(pilot, breaks_off=1.0)
    elif kind == "gusty":
        gusts = rng.uniform(1.0, 2.5)
    flown = single_point_card(card, point)
    return replace(flown, air=replace(card.air, turbulence_mps=gusts), pilot=pilot)


def flight(seed: int) -> Iterator[dict[str, object]]:
    """Fly one point, identify it, judge it by its radio."""
    card, of = points()
    kind = KINDS[seed % len(KINDS)]
    rng = np.random.default_rng([seed, 78])
    point = of[int(rng.integers(len(of)))]
    flown = drawn(card, point, kind, seed)
    made = virtual_flight(flown, seed)
    ratios = _ratios(flown, made.table, point)
    wanted = replace(
        single_point_card(card, point), air=replace(card.air, turbulence_mps=GUSTS_MPS)
    )
    sent = _sent(made.record)
    for lost in LOST:
        verdict = judged(wanted, made.record, sent, lost, seed)
        yield {
            "seed": seed,
            "kind": kind,
            "axis": point.axes[0],
            "lost": lost,
            "width": f"{math.exp(float(np.mean(np.log(ratios)))):.3f}",
            "worst": f"{ratios.max():.3f}",
            "found": int(verdict is not None),
            "good": int(verdict is not None and bool(verdict["good"])),
            "score": "" if verdict is None else verdict["score"],
            "late_s": "" if verdict is None else f"{verdict['said_s'] - verdict['end_s']:.2f}",
        }


def _ratios(flown: Card, table: pd.DataFrame, point: Segment) -> Array:
    """Return the half-widths of the wanted derivatives over the promised ones."""
    try:
        found = single_point_widths(point, table, flown.aircraft)
    except IdentificationError:
        found = {}
    own = promised(point)
    widths = [found[n].half_width if n in found else math.inf for n in point_derivatives(point)]
    return np.array(
        [min(w / own[n], NEVER) for n, w in zip(point_derivatives(point), widths, strict=True)]
    )


def _sent(record: FlightRecord) -> list[tuple[float, bytes]]:
    """Return the envelopes that the recorder's radio sends, with their time."""
    rate_hz = sitl.recorder_rate_hz(record.card.flight.rate_hz)
    given = stimuli(record, air_data(record))
    reader = EnvelopeReader()
    return [
        (part.t_s, envelope(frame))
        for part in radio(given, rate_hz=rate_hz, aircraft=AIRCRAFT)
        for frame in reader.feed(part.data)
    ]


def judged(
    card: Card, record: FlightRecord, sent: Sequence[tuple[float, bytes]], lost: float, seed: int
) -> dict[str, Any] | None:
    """Return the first verdict of a flight's radio; None where nothing was found."""
    text = calibration(record.aircraft, record.draws.errors)
    stream = LiveStream(calibration_of_text(text, Path("virtual")))
    watch = PointWatch(card)
    stream.subscribe(watch.hear)
    lump, at_s = b"", 0.0
    for (t_s, data), arrives in zip(sent, _arrives(len(sent), lost, seed), strict=True):
        lump += data if arrives else b""
        if t_s - at_s >= LUMP_S:
            stream.feed(lump, t_s)
            lump, at_s = b"", t_s
    stream.feed(lump, at_s)
    return watch.verdicts[0] if watch.verdicts else None


def _arrives(count: int, lost: float, seed: int) -> list[bool]:
    """Return which envelopes arrive: bursts of `BURST` on average are lost."""
    rng = np.random.default_rng([seed, 79])
    away, found = False, []
    for _ in range(count):
        if lost:
            away = rng.random() > 1.0 / BURST if away else rng.random() < lost / (1 - lost) / BURST
        found.append(not away)
    return found


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return how many of each kind were recognised, by truth, whole and with losses."""
    lines = ["kind          truth   whole radio   5 % lost"]
    kinds = ("all", *dict.fromkeys(KINDS))
    for kind in kinds:
        for truth in (True, False):
            cells = []
            for lost in LOST:
                own = [
                    r for r in rows
                    if float(r["lost"]) == lost and kind in ("all", r["kind"])
                    and (float(r["width"]) <= WITHIN) == truth
                ]  # fmt: skip
                right = sum((r["good"] == "1") == truth for r in own)
                share = f"{100.0 * right / len(own):.0f} %" if own else "-"
                cells.append(f"{right:3d} of {len(own):3d} ({share:>5s})")
            lines.append(f"{kind:12s}  {'good' if truth else 'bad':5s}  {'   '.join(cells)}")
    late = [float(r["late_s"]) for r in rows if r["late_s"]]
    found = sum(r["found"] == "1" for r in rows)
    lines.append(f"found {found} of {len(rows)}; verdict behind the point's end: at most"
                 f" {max(late, default=math.nan):.2f} s")  # fmt: skip
    worst = [r for r in rows if float(r["lost"]) == 0.0 and float(r["worst"]) <= WITHIN]
    kept = sum(r["good"] == "1" for r in worst)
    lines.append(f"good by the widest of its half-widths: {len(worst)}, of them said good {kept}")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=FLIGHTS)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--rows", type=Path, default=Path("../build/study/point_verdicts.csv"))
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.flights)
    rows = flown_rows(options.rows, COLUMNS, [(seed,) for seed in seeds], flight)
    print("\n".join(table([r for r in rows if int(r["seed"]) in seeds])))
    return 0


if __name__ == "__main__":
    sys.exit(main())
