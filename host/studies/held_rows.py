"""Rows that hold bank and pitch against the same rows without: what identification gains by it.

Each pair has aircraft, instrument, air and pilot in common. The logger triggers, flies and records
the rows; gains are those that `host tune --for mega` gave for `host simulate demo --seed 5`.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
from host.aircraft.linear_aircraft import load as load_aircraft
from host.errors import IdentificationError
from host.log import read_log
from host.log.flown_inputs import flown_inputs
from host.physical.calibration import calibration_of_text
from host.planning.flight_envelope import Envelope
from host.planning.hold_card import HoldGains
from host.planning.logger_card import logger_card
from host.sysid.answer import true_coefficients
from host.sysid.pipeline import identify
from host.twin.flight.fly import FlightRecord
from host.twin.outcome import truth_files
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.logger_flight import logger_flight
from host.twin.recorder.stimuli import Stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, Segment, load

from studies.demonstration import PRINCIPAL
from studies.judgement.interval_score import interval_score
from studies.stored_rows import flown_rows, seeded_run

FIRST_SEED, FLIGHTS = 49_100, 50
GUSTS_MPS = (0.0, 0.5, 1.0)
AIRCRAFT = "ultrastick25e"
GAINS = HoldGains(
    AIRCRAFT, date(2026, 11, 28),
    {"aileron": 0.71, "elevator": 0.79}, {"aileron": 0.235, "elevator": 0.265},
    {"aileron": 0.03, "elevator": 0.005}, {"aileron": 1.0, "elevator": -1.0},
)  # fmt: skip
COLUMNS = ("gusts_mps", "seed", "held", "done", "name", "true", "estimate", "half_width")


def card(gusts_mps: float) -> Card:
    """Return the flight: each surface twice, the demonstration's instrument and pilot."""
    rows = (
        Segment("3211", axes=("elevator",), amplitudes=(5.0,), width_s=0.2, before_s=1.0),
        Segment("doublet", axes=("rudder",), amplitudes=(6.0,), width_s=0.5, before_s=1.0),
        Segment("doublet", axes=("aileron",), amplitudes=(4.0,), width_s=0.6, before_s=1.0),
    )
    demo = load("demo")
    return replace(
        demo,
        segments=(*rows, *rows, Segment("trim", duration_s=3.0)),
        flight=replace(demo.flight, airspeed_mps=17.0),
        air=replace(demo.air, turbulence_mps=gusts_mps),
    )


def pair(gusts_mps: float, seed: int) -> Iterator[dict[str, object]]:
    """Fly with and without; return a row for each principal coefficient of each answer."""
    for hold in (None, GAINS):
        yield from _flown(gusts_mps, seed, hold)


def _flown(gusts_mps: float, seed: int, hold: HoldGains | None) -> Iterator[dict[str, object]]:
    plane, plan = load_aircraft(AIRCRAFT), card(gusts_mps)
    lines = calibration_of_text(calibration(plane), Path("calibration.toml"))
    wide = Envelope(distance_m=0, alpha_deg=14.0)
    data = logger_card(plan, plane, lines, wide, hold=hold)

    def recorder(record: FlightRecord, given: Stimuli) -> sitl.Recording:
        name = record.aircraft.name
        return sitl.record(given, rate_hz=100, aircraft=name, seed=seed, flight_card=data)

    record, _, recording = logger_flight(data, plan, seed=seed, recorder=recorder)
    truth = truth_files.maneuvers(record, air_data(record))
    with tempfile.TemporaryDirectory() as folder:
        log, own = Path(folder) / "flight.bin", Path(folder) / "calibration.toml"
        log.write_bytes(recording.log)
        own.write_text(calibration(record.aircraft, record.draws.errors), encoding="utf-8")
        done = sum(row.reason == "done" for row in flown_inputs(read_log(log)))
        try:
            answers = identify(log, aircraft=AIRCRAFT, calibration=own).linear
        except IdentificationError:
            answers = ()
    found = {
        c.name: (true_coefficients({"maneuver": truth}, answer.template)[c.name], c)
        for answer in answers
        for c in answer.coefficients
    }
    for name in PRINCIPAL:
        true, c = found.get(name, ("", None))
        value = ("", "") if c is None else (c.value, c.half_width)
        key = gusts_mps, seed, int(hold is not None), done, name
        yield dict(zip(COLUMNS, (*key, true, *value), strict=True))


def table(rows: Sequence[dict[str, str]]) -> list[str]:
    """Return a line for each air, with and without, then each coefficient's signed error."""
    lines = ["gusts m/s  held  flights  rows done   est  hold %  median half-width %  score %"]
    answered = [r for r in rows if r["estimate"]]
    cells = sorted({(float(r["gusts_mps"]), int(r["held"])) for r in rows})

    def of(cell: tuple[float, int], among: Sequence[dict[str, str]]) -> list[dict[str, str]]:
        return [r for r in among if (float(r["gusts_mps"]), int(r["held"])) == cell]

    for cell in cells:
        error, width = _shares(of(cell, answered))
        done = {r["seed"]: int(r["done"]) for r in of(cell, rows)}
        score = 100.0 * interval_score(abs(error), width)
        lines.append(
            f"{cell[0]:9.1f}  {cell[1]:4d}  {len(done):7d}  {np.mean(list(done.values())):9.2f}"
            f"  {len(error):4d}  {100.0 * np.mean(abs(error) <= width):6.1f}"
            f"  {100.0 * np.median(width):19.1f}  {np.median(score):7.1f} (mean {score.mean():.1f})"
        )
    lines.append("mean signed error, half-widths, and its standard error:")
    lines.append("name        " + "  ".join(f"{g:3.1f} m/s, {h}      " for g, h in cells))
    for name in PRINCIPAL:
        line = f"{name:10s}"
        for cell in cells:
            error, width = _shares([r for r in of(cell, answered) if r["name"] == name])
            z = error / width
            line += f"  {z.mean():+6.2f} +- {z.std() / len(z) ** 0.5:4.2f}" if len(z) else " " * 16
        lines.append(line)
    return lines


def _shares(rows: Sequence[dict[str, str]]) -> tuple[np.ndarray, np.ndarray]:
    """Return errors and half-widths as shares of the true values."""
    true, estimate, half = (
        np.array([float(r[name]) for r in rows]) for name in ("true", "estimate", "half_width")
    )
    return (estimate - true) / np.abs(true), half / np.abs(true)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what is not in the file yet and print the table."""
    run = seeded_run(
        "held_rows", __doc__, arguments, flights=FLIGHTS, first_seed=FIRST_SEED, each="pairs a cell"
    )
    keys = ((gusts, seed) for seed in run.seeds for gusts in GUSTS_MPS)
    return run.report(flown_rows(run.rows, COLUMNS, keys, pair), table)


if __name__ == "__main__":
    sys.exit(main())
