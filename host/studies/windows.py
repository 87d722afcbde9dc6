"""Answers from the windows that detection finds, against those from the whole record.

Linear records first: NAVION with gravity and constants free, and the Ultra Stick 25e sideways, in
white noise, inputs, then hands off. Detection sees the surfaces. The same model is fitted to the
windows and to the whole record; the bound is that of the whole record with the noise known. Then
cards of the twin through the recorder, every tolerance drawn, by the answer that the verb gives.
Every finished flight is a line of a file: a run that was broken off goes on behind it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from host.arrays import Array
from host.errors import IdentificationError
from host.readers.even_grid import even_columns
from host.sysid.answer import true_coefficients
from host.sysid.estimators import fit
from host.sysid.maneuvers.maneuver_detection import FLYING_SHARE, detect_maneuvers
from host.sysid.maneuvers.maneuver_selection import SURFACES, joined_windows, select_maneuvers
from host.sysid.models import FitResult, LinearModel, Maneuver, Parameter, Term
from host.sysid.numerics import OutputProblem, covariance_of_free, minimise
from host.sysid.pipeline import at_hand, identify_columns
from host.twin.virtual import virtual_flight

from studies.flights import PRINCIPAL
from studies.gusts import NOISE, gusty_aircraft
from studies.inputs import LEAD_S, steps
from studies.navion import navion_structured
from studies.stored_rows import rows_file

SNR = 10.0
FIRST_SEED = 6000  # 100 to 129 and 5000 to 5049 were looked at while detection was written
FIRST_FLIGHT = 5000  # of cards; 200 to 207 were looked at
AXES = ("longitudinal", "lateral")
ALONG = ("CL", "CD", "Cm")
DERIVATIVES = tuple(name for name in PRINCIPAL if name != "CD_0")
LIMIT_WHOLE, LIMIT_BOUND = 1.15, 1.3
CARDS = (
    "demo", "calm", "mixed", "multisine", "survey", "sweep", "thesis_flight1", "thesis_flight2",
)  # fmt: skip
SETTLED_S = 3.0  # after the launch of a card
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Case:
    """One aircraft and one input.

    Attributes
    ----------
    aircraft : str
        ``navion`` or ``ultrastick``.
    shape : str
        ``3-2-1-1``, ``doublet``, ``pulse``, ``multisine``; with `` at once`` the record begins in
        its input, with `` late`` 25 s before it, with `` twice`` a second one follows.
    rate_hz, amplitude_rad, duration_s : float
    """

    aircraft: str
    shape: str
    rate_hz: float
    amplitude_rad: float
    duration_s: float

    @property
    def label(self) -> str:
        """What the tables call it."""
        size_deg = np.rad2deg(self.amplitude_rad)
        return f"{self.aircraft} {self.shape}, {size_deg:.1f} deg, {self.rate_hz:.0f} Hz"


CASES = (
    Case("navion", "3-2-1-1", 20.0, 0.05, 60.0),
    Case("navion", "doublet", 50.0, 0.04, 60.0),
    Case("navion", "doublet twice", 50.0, 0.04, 60.0),
    Case("navion", "pulse", 20.0, 0.05, 60.0),
    Case("navion", "multisine", 50.0, 0.05, 30.0),
    Case("navion", "multisine", 20.0, 0.02, 60.0),
    Case("navion", "multisine at once", 50.0, 0.03, 20.0),
    Case("navion", "3-2-1-1 at once", 50.0, 0.05, 20.0),
    Case("ultrastick", "3-2-1-1", 50.0, 0.07, 20.0),
    Case("ultrastick", "doublet", 50.0, 0.05, 15.0),
    Case("ultrastick", "multisine", 50.0, 0.04, 25.0),
    Case("navion", "3-2-1-1 late", 20.0, 0.05, 120.0),
)


@cache
def navion() -> LinearModel:
    """Return the NAVION with gravity free too, and the constants that a record has."""
    model = navion_structured()
    A, known = np.array(model.A), float(model.A[0, 3])
    A[0, 3] = 0.0
    return replace(
        model,
        A=A,
        terms=(*model.terms, Term("A", 0, 3, "g")),
        parameters=(*model.parameters, Parameter("g", known)),
        state_biases=model.states[:3],
    )


def test_input(case: Case, rng: np.random.Generator) -> Array:
    """Return the surface, (samples,)."""
    dt_s, size = 1.0 / case.rate_hz, case.amplitude_rad
    lead_s = {"once": 0.0, "late": 25.0}.get(case.shape.split()[-1], 3.0)
    unit_s = 1.0 if case.aircraft == "navion" else 0.35
    parts = {
        "3-2-1-1": ((3.0, 1), (2.0, -1), (1.0, 1), (1.0, -1)),
        "doublet": ((1.0, 1), (1.0, -1)),
        "pulse": ((2.0, 1),),
    }.get(case.shape.split()[0])
    if parts is not None:
        pattern = [(lead_s, 0.0)] + [(n * unit_s, s * size) for n, s in parts]
        motion = steps(pattern, dt_s, case.duration_s + LEAD_S)
        cut = np.asarray(motion[round(LEAD_S / dt_s) :, 0])
        return cut - np.roll(cut, len(cut) // 2) if case.shape.endswith("twice") else cut
    t = dt_s * np.arange(round(case.duration_s / dt_s))
    lines = np.arange(2, 41) / 20.0  # Hz, over 20 s
    phase = rng.uniform(0.0, 2.0 * np.pi, len(lines))
    inside = (t >= lead_s) & (t < lead_s + 20.0)
    wave = np.sin(2.0 * np.pi * np.outer(t - lead_s, lines) + phase).sum(axis=1) * inside
    return np.asarray(wave * size / np.max(np.abs(wave)))


def linear_row(case: Case, seed: int) -> Row:
    """Fly one linear record, fit its windows and the whole; return errors over the bound."""
    rng = np.random.default_rng([20261122, seed, CASES.index(case)])
    sideways = case.aircraft != "navion"
    model = gusty_aircraft().models["lateral"] if sideways else navion()
    surface = test_input(case, rng)
    u = np.zeros((len(surface), len(model.inputs)))
    for k in range(len(model.inputs)):  # aileron, then rudder
        u[:, k] = np.roll(surface, k * len(surface) // 2) if k else surface
    dt_s = 1.0 / case.rate_hz
    blank = Maneuver(dt_s, u, np.zeros((len(u), len(model.outputs))))
    problem = OutputProblem(model, [blank])
    truth = np.concatenate([model.start, np.zeros(len(problem.names) - len(model.start))])
    response = problem.respond(truth)
    assert response is not None
    y = response[0].y.T
    deviation = (
        np.array([NOISE[name] for name in model.outputs])
        if sideways
        else np.sqrt(np.mean(y**2, axis=0) / SNR)
    )
    best = minimise(problem, truth, variance=deviation**2, max_iterations=0)
    bound = np.sqrt(np.diag(covariance_of_free(best.information, best.free)))
    measured = y + deviation * rng.standard_normal(y.shape)
    t = dt_s * np.arange(len(u))
    columns = {"t_s": t} | dict(
        zip(("aileron_rad", "rudder_rad") if sideways else ("elevator_rad",), u.T, strict=True)
    )
    [found] = joined_windows([detect_maneuvers(columns)])
    cuts = []
    for item in found:
        first_s, last_s = item.fit_window()
        inside = (t >= first_s - 1e-9) & (t <= last_s + 1e-9)
        cuts.append(Maneuver(dt_s, u[inside], measured[inside], name=item.kind))
    count = len(model.parameters)
    row: Row = {"names": [p.name for p in model.parameters], "windows": len(found)}
    for label, data in (("whole", [Maneuver(dt_s, u, measured)]), ("found", cuts)):
        row[label] = _judged(model, data, truth[:count], bound[:count]) if data else None
    return row


def _judged(
    model: LinearModel, data: Sequence[Maneuver], truth: Array, bound: Array
) -> list[list[float]] | None:
    """Return error, whether the interval holds it, and half-width of each parameter, in bounds."""
    try:
        result: FitResult = fit("output-error-white", model, data, multiple_starts=False)
    except IdentificationError:
        return None
    count = len(truth)
    half = result.half_width()[:count]
    error = result.estimate[:count] - truth
    columns = np.column_stack([error / bound, np.abs(error) <= half, half / bound])
    return [[float(x) for x in entry] for entry in columns]


def twin_row(card: str, seed: int) -> Row:
    """Fly a card, answer from the windows and from the whole flight; errors over the truth."""
    flight = virtual_flight(card, seed)
    aircraft = flight.record.aircraft.name
    columns, _ = even_columns(flight.table)
    t, speed = columns["t_s"], columns["airspeed_mps"]
    up = t[speed > FLYING_SHARE * float(np.median(speed))]
    whole = select_maneuvers(columns, stretches=[(float(up[0]) + SETTLED_S, float(up[-1]))])
    found = detect_maneuvers(columns)
    both = {"whole": [replace(whole[0], axis=a) for a in SURFACES], "found": found}
    document = {"maneuver": list(flight.maneuvers)}
    row: Row = {"names": [], "windows": len(found), "whole": [], "found": []}
    for axis in AXES:
        local = true_coefficients(document, axis)
        names = [n for n in DERIVATIVES if (n[:2] in ALONG) == (axis == AXES[0])]
        row["names"] += names
        for label, windows in both.items():
            try:
                flown = at_hand(columns, aircraft=aircraft, windows=windows)
                [answer] = identify_columns(flown, models=axis).linear
            except IdentificationError:
                row[label] += [None] * len(names)
                continue
            intervals = {c.name: (c.value, c.half_width) for c in answer.coefficients}
            row[label] += [_entry(*intervals[name], local[name]) for name in names]
    return row


def _entry(value: float, half: float, truth: float) -> list[float]:
    """Return error over the truth, whether the interval holds it, and half-width over it."""
    error = value - truth
    return [error / abs(truth), float(abs(error) <= half), half / abs(truth)]


@dataclass(frozen=True)
class Compared:
    """Both answers over many flights of one case, an entry of each array per parameter."""

    label: str
    names: tuple[str, ...]
    flights: int
    failed: int
    missed: int
    whole_rms: Array
    found_rms: Array
    whole_held: Array
    found_held: Array
    whole_half: Array

    @property
    def ratio(self) -> Array:
        """Error from windows over error from the whole record."""
        return self.found_rms / self.whole_rms


def compared(label: str, rows: Sequence[Row]) -> Compared:
    """Return the summary of a case; a flight without an answer counts as failed."""
    good = [r for r in rows if r["whole"] and r["found"] and None not in r["found"] + r["whole"]]
    if not good:
        none = np.full(1, np.nan)
        return Compared(label, ("-",), 0, len(rows), len(rows), *[none] * 5)
    whole, found = (np.array([r[k] for r in good]) for k in ("whole", "found"))
    return Compared(
        label,
        tuple(good[0]["names"]),
        len(good),
        len(rows) - len(good),
        sum(r["windows"] == 0 for r in rows),
        np.sqrt(np.mean(whole[..., 0] ** 2, axis=0)),
        np.sqrt(np.mean(found[..., 0] ** 2, axis=0)),
        np.mean(whole[..., 1], axis=0),
        np.mean(found[..., 1], axis=0),
        np.median(whole[..., 2], axis=0),
    )


def stored_rows(path: Path, label: str, seeds: range, make: Callable[[int], Row]) -> list[Row]:
    """Return a row of each seed, made where the file has none; each is written at once."""
    have: dict[tuple[str, int], Row] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            have[row["label"], row["seed"]] = row
    for seed in seeds:
        if (label, seed) in have:
            continue
        row = {"label": label, "seed": seed, **make(seed)}
        have[label, seed] = row
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
    return [have[label, seed] for seed in seeds]


def study(path: Path, seeds: range, cards: Sequence[str], card_seeds: range) -> Iterator[Compared]:
    """Yield every case as it is done."""
    for case in CASES if len(seeds) else ():
        rows = stored_rows(path, case.label, seeds, partial(linear_row, case))
        yield compared(case.label, rows)
    for card in cards:
        label = f"card {card}"
        yield compared(label, stored_rows(path, label, card_seeds, partial(twin_row, card)))


def line(case: Compared) -> str:
    """Return one line of the table."""
    k = int(np.nanargmax(case.ratio)) if np.isfinite(case.ratio).any() else 0
    return (
        f"{case.label:42s} flights {case.flights:3d} failed {case.failed:2d}"
        f" missed {case.missed:2d}"
        f"  found/whole most {case.ratio[k]:5.2f} ({case.names[k]}) median"
        f" {np.median(case.ratio):5.2f}  found rms most {case.found_rms.max():6.2f}"
        f"  covered {100.0 * np.mean(case.found_held):5.1f} whole"
        f" {100.0 * np.mean(case.whole_held):5.1f} %"
    )


def main(arguments: list[str] | None = None) -> int:
    """Print a line per case; `--rows` keeps finished flights."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=rows_file, default=Path("windows.jsonl"))
    parser.add_argument("--flights", type=int, default=50, help="seeds of every linear record")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first of them")
    parser.add_argument("--card-flights", type=int, default=0, help="seeds of every card")
    parser.add_argument("--first-flight", type=int, default=FIRST_FLIGHT, help="first of them")
    parser.add_argument("--card", choices=CARDS, action="append", help="this card, not all")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.flights)
    flights = range(options.first_flight, options.first_flight + options.card_flights)
    cards = (options.card or CARDS) if len(flights) else ()
    for case in study(options.rows, seeds, cards, flights):
        sys.stdout.write(line(case) + "\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
