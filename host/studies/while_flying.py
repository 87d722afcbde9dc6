"""Estimates while flying, from the radio's rows, against the truth and what comes later.

After each completed test point all that was received until then is estimated from, as the page of
`host live` does; after the flight the log of the card is identified. One row an estimate goes to a
file that a later run continues.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from host.aircraft.mass_properties import airframe_data
from host.errors import IdentificationError
from host.live.estimates.flight_estimate import FlightEstimate, FlightEstimator
from host.planning.wanted_widths import WANTED_PERCENT
from host.sysid.answer import true_coefficients
from host.sysid.pipeline import identify
from host.twin.testcard.cards import Card, load

from studies.linear import derivatives
from studies.radio_flights import RadioFlight, after_each_point, lost_in_bursts, radio_flight
from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED = 11_000
LOSSES = (0.0, 0.05)
DEFAULTS = 12  # flights whose card is identified by the default too, a linear model
AIRCRAFT = "ultrastick25e"
BEHIND_S = 3.8  # of an input: its response, and the last rows have come
NAMES = tuple(WANTED_PERCENT)
COLUMNS = (
    "air", "seed", "loss", "kind", "points", "name", "true", "estimate", "half_width", "cpu_s",
)  # fmt: skip
RATE_NAMES = {"M_alpha": "alpha_rad", "M_q": "q_radps"}


def card_of(air: str) -> Card:
    """Return the demonstration's card; in still air its first 3-2-1-1 alone."""
    demo = load("demo")
    if air == "gusts":
        return demo
    calm = replace(demo.air, turbulence_mps=0.0, wind_north_mps=0.0, wind_east_mps=0.0)
    first = [s for s in demo.segments if s.kind != "turn"][:3]
    return replace(demo, air=calm, segments=tuple(first))


def rows_of(air: str, seed: int, with_default: bool) -> Iterator[dict[str, object]]:
    """Fly once and yield the estimates of every test point, then those from the card's log."""
    flight = radio_flight(card_of(air), seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "calibration.toml").write_text(flight.calibration, encoding="utf-8")
        by = FlightEstimator(AIRCRAFT, folder / "calibration.toml")
        for loss in LOSSES:
            head = {"air": air, "seed": seed, "loss": loss, "kind": "live"}
            sent = lost_in_bursts(flight.sent, loss, seed) if loss else flight.sent
            for number, data in enumerate(after_each_point(sent, flight.truth, BEHIND_S), 1):
                (folder / "live.radio").write_bytes(data)
                began = time.process_time()
                found = by.at(folder / "live.radio")
                used_s = time.process_time() - began
                yield from _rows(head | {"points": number}, flight, found, used_s)
                if air != "gusts":
                    break
        if air == "gusts":
            (folder / "card.bin").write_bytes(flight.card_log(seed))
            for kind in ("card", "default") if with_default else ("card",):
                after = {"air": air, "seed": seed, "loss": 0.0, "kind": kind, "points": 0}
                yield from _after_landing(after, flight, folder)


def _rows(
    head: dict[str, object], flight: RadioFlight, found: FlightEstimate, used_s: float
) -> Iterator[dict[str, object]]:
    said = dict(found.values)
    truth = flight.truth[: int(str(head["points"]))] or flight.truth
    true = true_coefficients({"maneuver": truth}, "longitudinal")
    true |= {
        k: v
        for k, v in true_coefficients({"maneuver": truth}, "lateral").items()
        if k[:2] not in ("CL", "CD", "Cm")
    }
    if found.answer is not None and "longitudinal" in found.answer.systems:
        system = found.answer.systems["longitudinal"]
        row = system.states.index("q_radps")
        for name, state in RATE_NAMES.items():
            at = system.states.index(state)
            said[name] = float(system.A[row, at]), float(system.A_half[row, at])
        true |= derivatives(true, truth, "longitudinal", airframe_data(AIRCRAFT), flight.sizes)
    for name in (*NAMES, *RATE_NAMES):
        if name in said and name in true:
            values = (name, true[name], *said[name], used_s)
            yield head | dict(zip(COLUMNS[5:], values, strict=True))


def _after_landing(
    head: dict[str, object], flight: RadioFlight, folder: Path
) -> Iterator[dict[str, object]]:
    """Yield the answer of the whole flight: the coefficients' or the default's."""
    began = time.process_time()
    try:
        found = identify(
            folder / "card.bin",
            aircraft=AIRCRAFT,
            calibration=folder / "calibration.toml",
            models="coefficients" if head["kind"] == "card" else ("longitudinal", "lateral"),
        )
    except IdentificationError:
        return
    values = {
        c.name: (c.value, c.half_width) for t in found.coefficient_tables for c in t.coefficients
    }
    estimate = FlightEstimate(0.0, (), "", values)
    yield from _rows(head, flight, estimate, time.process_time() - began)


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return the table: estimates in gusts, a line a loss, and those in still air."""
    lines = [
        "loss  estimates  holds the truth   agrees with later   half-width: live  card  default"
    ]
    for loss in sorted({r["loss"] for r in rows}):
        own = [r for r in rows if r["air"] == "gusts" and r["loss"] == loss and r["name"] in NAMES]
        live = [r for r in own if r["kind"] == "live"]
        every = [r for r in rows if r["air"] == "gusts" and r["name"] in NAMES]
        after = {(r["kind"], r["seed"], r["name"]): r for r in every if r["kind"] != "live"}
        if not live:
            continue
        held = [_held(r) for r in live]
        agree = {
            kind: [
                _agrees(r, after[k]) for r in live if (k := (kind, r["seed"], r["name"])) in after
            ]
            for kind in ("card", "default")
        }
        ends = [r for r in live if r["points"] == max(x["points"] for x in live)]
        widths = [
            100.0 * float(np.median([float(r["half_width"]) / abs(float(r["true"])) for r in some]))
            for some in (ends, *([r for r in every if r["kind"] == k] for k in ("card", "default")))
            if some
        ]
        lines.append(
            f"{float(loss):4.2f}  {len(live):9d}  {_share(held)}  card {_share(agree['card'])},"
            f" default {_share(agree['default'])}  " + "  ".join(f"{w:5.1f} %" for w in widths)
        )
    lines += ["", "by derivative: median error, half-width, holds"]
    for name in NAMES:
        own = [r for r in rows if r["air"] == "gusts" and r["kind"] == "live" and r["name"] == name]
        if own:
            lines.append(f"  {name:9s} {_errors(own)}")
    lines += ["", "still air, the first 3-2-1-1:"]
    for loss in sorted({r["loss"] for r in rows}):
        for name in RATE_NAMES:
            own = [
                r for r in rows
                if r["air"] == "still" and r["name"] == name and r["loss"] == loss
            ]  # fmt: skip
            if own:
                lines.append(f"  loss {float(loss):4.2f}  {name:8s} {_errors(own)}")
    return lines


def _held(row: dict[str, str]) -> bool:
    return abs(float(row["estimate"]) - float(row["true"])) <= float(row["half_width"])


def _agrees(row: dict[str, str], after: dict[str, str]) -> bool:
    apart = abs(float(row["estimate"]) - float(after["estimate"]))
    return bool(apart <= np.hypot(float(row["half_width"]), float(after["half_width"])))


def _share(found: Sequence[bool]) -> str:
    return f"{sum(found):5d} of {len(found):5d} ({100.0 * np.mean(found) if found else 0.0:5.1f} %)"


def _errors(rows: Sequence[dict[str, str]]) -> str:
    truth, value, half = (
        np.array([float(r[k]) for r in rows]) for k in ("true", "estimate", "half_width")
    )
    error = 100.0 * (value - truth) / np.abs(truth)
    width, held = 100.0 * np.median(half / np.abs(truth)), _share([_held(r) for r in rows])
    return (
        f"median |error| {np.median(np.abs(error)):5.1f} %  mean {np.mean(error):+5.1f} %"
        f"  half-width {width:5.1f} %  {held}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    run = seeded_run("while_flying", __doc__, arguments, flights=50, first_seed=FIRST_SEED)
    keys = [(air, seed) for seed in run.seeds for air in ("gusts", "still")]
    rows = flown_rows(
        run.rows,
        COLUMNS,
        keys,
        lambda air, seed: list(rows_of(air, seed, seed < run.seeds.start + DEFAULTS)),
    )
    return run.report(rows, table)


if __name__ == "__main__":
    sys.exit(main())
