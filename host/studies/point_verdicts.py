"""Verdicts of test points in flight against what identification made of them.

One flight is one test point, flown through the recorder by a pilot with one drawn fault or none.
The verdict: from its radio as the firmware sends it, whole and with one envelope in twenty lost in
bursts. Truth: the same inputs flown in other gusts with other sensor noise, identified at 100 Hz,
the median of their half-widths against those that `host plan --alone` promises. A row a flight and
loss goes to a file that a later run continues.
"""

from __future__ import annotations

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
from host.errors import IdentificationError
from host.live.live_stream import LiveStream
from host.live.test_point.point_estimate import PROMISE_FLIGHTS, PointEstimate, PointEstimator
from host.live.test_point.point_watch import PointWatch
from host.physical.calibration import calibration_of_text
from host.planning.card_design import design
from host.planning.point_widths import (
    PointPromise,
    identify_single_point,
    point_derivatives,
    promise_points,
    single_point_card,
    test_points,
)
from host.sysid.maneuvers import DetectedManeuver
from host.twin.flight.fly import FlightRecord
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.sitl_radio import radio
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, Segment
from host.twin.virtual import virtual_flight
from host.wire.framing import EnvelopeReader, envelope

from studies.stored_rows import flown_rows, seeded_run

AIRCRAFT = "ultrastick25e"
FIRST_SEED, FLIGHTS = 17400, 260
GUSTS_MPS = 0.3
WITHIN = 1.3  # times the promise
NEAR = (0.9, 1.15)  # times that: so close, a half-width may be called either way
# Other airs that tell the truth: some, and more where their median is so near `WITHIN`.
AIRS, AIRS_NEAR, UNSURE = 7, 28, (0.85, 1.2)
KINDS = ("good", "late", "weak", "axis", "interrupted", "gusty")
LOST = (0.0, 0.05)
BURST = 6  # envelopes, mean
LUMP_S = 0.2
COLUMNS = (
    "seed", "kind", "axis", "lost", "width", "worst", "log", "alike", "found", "good", "score",
    "estimated", "late_s",
)  # fmt: skip
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
def promised(point: Segment) -> PointPromise:
    """Return what a point alone is promised to tell."""
    card, _ = points()
    [found] = promise_points(single_point_card(card, point), GUSTS_MPS, flights=PROMISE_FLIGHTS)
    return found


class AtOnce:
    """Estimates when it is asked: time stands still in a study."""

    def __init__(self, by: PointEstimator) -> None:
        self._by, self._found = by, PointEstimate()

    def ask(self, point: Segment, data: bytes, flown: DetectedManeuver) -> None:
        """Estimate."""
        self._found = self._by.estimate(point, data, flown)

    def answer(self, timeout_s: float = 0.0) -> PointEstimate | None:
        """Return what was found."""
        return self._found

    def close(self) -> None:
        """Nothing is left."""


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
    own = _ratios(flown, made.table, point)
    others = in_other_airs(flown, point, seed)
    ratios = np.median(others, axis=0)
    wanted = replace(
        single_point_card(card, point), air=replace(card.air, turbulence_mps=GUSTS_MPS)
    )
    sent = _sent(made.record)
    for lost in LOST:
        verdict = judged(wanted, point, made.record, sent, lost, seed)
        yield {
            "seed": seed,
            "kind": kind,
            "axis": point.axes[0],
            "lost": lost,
            "width": f"{_mean(ratios):.3f}",
            "worst": f"{ratios.max():.3f}",
            "log": f"{_mean(own):.3f}",
            "alike": f"{_alike([_mean(one) <= WITHIN for one in (own, *others[:AIRS])]):.3f}",
            "found": int(verdict is not None),
            "good": int(verdict is not None and bool(verdict["good"])),
            "score": "" if verdict is None else verdict["score"],
            "estimated": int(verdict is not None and bool(verdict["estimated"])),
            "late_s": "" if verdict is None else f"{verdict['said_s'] - verdict['end_s']:.2f}",
        }


def in_other_airs(flown: Card, point: Segment, seed: int) -> Array:
    """Return the half-widths over the promised ones in other gusts and sensor noise, (n, k)."""
    found: list[Array] = []
    for count in (AIRS, AIRS_NEAR):
        for k in range(len(found), count):
            other = virtual_flight(flown, seed, noise_seed=1_000_000 * (k + 1) + seed)
            found.append(_ratios(flown, other.table, point))
        if not UNSURE[0] < _mean(np.median(found, axis=0)) / WITHIN < UNSURE[1]:
            break
    return np.array(found)


def _mean(ratios: Array) -> float:
    return math.exp(float(np.mean(np.log(ratios))))


def _alike(good: Sequence[bool]) -> float:
    """Return the share of pairs of logs that call a point alike."""
    yes, count = sum(good), len(good)
    return (math.comb(yes, 2) + math.comb(count - yes, 2)) / math.comb(count, 2)


def _ratios(flown: Card, table: pd.DataFrame, point: Segment) -> Array:
    """Return the half-widths of the wanted derivatives over the promised ones."""
    try:
        found = identify_single_point(point, table, flown.aircraft).widths
    except IdentificationError:
        found = {}
    own = {w.name: w.half_width for w in promised(point).widths}
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
    card: Card,
    point: Segment,
    record: FlightRecord,
    sent: Sequence[tuple[float, bytes]],
    lost: float,
    seed: int,
) -> dict[str, Any] | None:
    """Return the first verdict of a flight's radio; None where nothing was found."""
    text = calibration(record.aircraft, record.draws.errors)
    stream = LiveStream(calibration_of_text(text, Path("virtual")))
    by = PointEstimator(card, text, {point: promised(point)})
    watch = PointWatch(card, estimates=AtOnce(by))
    stream.subscribe(watch.hear)
    lump, at_s = b"", 0.0
    for (t_s, data), arrives in zip(sent, _arrives(len(sent), lost, seed), strict=True):
        lump += data if arrives else b""
        if t_s - at_s >= LUMP_S:
            stream.feed(lump, t_s)
            watch.take(lump)
            watch.tick()
            lump, at_s = b"", t_s
        if watch.verdicts:
            break
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
    """Return how many were judged rightly of each kind, and how many of the others are near 1.3."""
    lines = [f"{'kind':12s}  truth  {'whole radio':>34s}  {'5 % lost':>34s}"]
    for kind in ("all", *dict.fromkeys(KINDS)):
        for truth in ((True,), (False,), (True, False)):
            own = [
                [
                    r for r in rows
                    if float(r["lost"]) == lost and kind in ("all", r["kind"]) and _good(r) in truth
                ]
                for lost in LOST
            ]  # fmt: skip
            called = "either" if len(truth) == 2 else "good" if truth[0] else "bad"
            lines.append(f"{kind:12s}  {called:6s} {'  '.join(map(_share_right, own))}")
    lines += ["", "against the half-widths of the point's one log", *_against_one_log(rows), ""]
    late = [float(r["late_s"]) for r in rows if r["late_s"]]
    found = sum(r["found"] == "1" for r in rows)
    lines.append(f"found {found} of {len(rows)}; verdict behind the point's end: at most"
                 f" {max(late, default=math.nan):.2f} s")  # fmt: skip
    worst = [r for r in rows if float(r["lost"]) == 0.0 and float(r["worst"]) <= WITHIN]
    kept = sum(r["good"] == "1" for r in worst)
    lines.append(f"good by the widest of its half-widths: {len(worst)}, of them said good {kept}")
    return lines


def _against_one_log(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return by kind how many verdicts agree with the own log, and how far logs do at all."""
    lines = [f"{'':20s}  {'whole radio':>34s}  {'5 % lost':>34s}  log is truth  two logs alike"]
    for kind in dict.fromkeys(KINDS):
        own = [[r for r in rows if float(r["lost"]) == lost and r["kind"] == kind] for lost in LOST]
        shares = "  ".join(_share_right(one, "log") for one in own)
        same = sum(_good(r, "log") == _good(r) for r in own[0])
        alike = 100.0 * float(np.mean([float(r["alike"]) for r in own[0]])) if own[0] else math.nan
        lines.append(f"{kind:20s}  {shares}  {same:3d} of {len(own[0]):3d}  {alike:12.0f} %")
    return lines


def _good(row: dict[str, str], by: str = "width") -> bool:
    return float(row[by]) <= WITHIN


def _share_right(rows: Sequence[dict[str, str]], by: str = "width") -> str:
    """Return how many were judged rightly, its standard error, and what of the rest is at 1.3."""
    wrong = [float(r[by]) for r in rows if (r["good"] == "1") != _good(r, by)]
    if not rows:
        return f"{'-':>34s}"
    share = 1.0 - len(wrong) / len(rows)
    error = 100.0 * math.sqrt(share * (1.0 - share) / len(rows))
    near = sum(NEAR[0] < width / WITHIN < NEAR[1] for width in wrong)
    share_text = f"{len(rows) - len(wrong)} of {len(rows)}, {100.0 * share:.0f} +- {error:.0f} %"
    return f"{share_text:>24s}, {near} of {len(wrong)}".rjust(34)


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run("point_verdicts", __doc__, arguments, flights=FLIGHTS, first_seed=FIRST_SEED)
    rows = flown_rows(run.rows, COLUMNS, [(seed,) for seed in run.seeds], flight)
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
