"""Flights drawn from one instrument file, analysed with another: do intervals hold, is it noticed?

Each flight has an instrument of its own, drawn from one file with every tolerance on. It is
analysed twice: with that file, and with one that claims a third of every deviation (the aircraft
file's tolerances too). Pooled over the principal derivatives of `--model coefficients`: how many
truths lie inside, and how often the compatibility check doubts the file.

The instrument is not the one the package calls standard: its calibration is twice as wide and
every error normal, so that neither answer rests on numbers the identifier knows. Rows go to a file
as they are found, and flights that are in it are not flown again.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from host.aircraft.file import load as load_aircraft
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.errors import IdentificationError
from host.instrument.deviations import SensorErrorModel, sensor_error_model
from host.instrument.instrument_errors import InstrumentErrors, instrument_errors
from host.readers.even_grid import even_columns
from host.sysid.pipeline import aircraft_data, at_hand, identify_columns
from host.sysid.reconstruction import reconstruct
from host.twin.testcard.cards import Card, load
from host.twin.virtual import VirtualFlight, virtual_flight

from studies.coefficients import truths
from studies.stored_rows import rows_file

AIRCRAFT = "ultrastick25e"
FIRST_SEED = 10_900  # 7000-7023 were looked at while this was written
FLIGHTS = 60
COUNTED = (
    "CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr",
)  # fmt: skip
ROWS = Path("../build/study/instrument_honesty.jsonl")
CLAIMS = {"honest": 1.0, "a third": 1.0 / 3.0}
WIDER = 2.0
# What a calibration states; the rest is as the package has it.
CALIBRATED = (
    "gyro_bias_radps", "gyro_scale", "accel_bias_mps2", "accel_scale", "vane_zero_rad",
    "vane_scale", "pitot_zero_pa", "pitot_scale", "pot_zero_rad", "pot_scale", "misalignment_rad",
)  # fmt: skip
Row = dict[str, Any]


def true_errors() -> InstrumentErrors:
    """Return the file that flights are drawn from: every error normal, calibrated ones wider."""
    wider = instrument_errors(load_aircraft(AIRCRAFT)).scaled(WIDER, *CALIBRATED)
    return InstrumentErrors(
        {e.name: replace(e, distribution="normal", width=e.sigmas) for e in wider}
    )


def every_tolerance(card: str) -> Card:
    """Return a card with every tolerance drawn."""
    plan = load(card)
    every = replace(
        plan.sensors, friction_tolerance=True, thrust_tolerance=True, servo_tolerance=True
    )
    return replace(plan, sensors=every)


def drawing(expected: Mapping[str, float], seed: int) -> AirframeData:
    """Return the aircraft's data with the arms of the tail off by the tolerance of its drawing.

    The packaged drawing has the same arms in every flight, the rudder's 6 % shorter than the
    derivatives behind the simulation: an error that no draw makes good.
    """
    a = airframe_data(AIRCRAFT)
    off = 1.0 + a.arm_share * np.random.default_rng([seed, 9]).standard_normal(2)
    return replace(
        a,
        elevator_arm_m=float(-off[0] * a.chord_m * expected["Cm_de"] / expected["CL_de"]),
        rudder_arm_m=float(-off[1] * a.span_m * expected["Cn_dr"] / expected["CY_dr"]),
    )


def claimed(airframe: AirframeData, factor: float) -> tuple[AirframeData, SensorErrorModel]:
    """Return the files that claim a factor of the true deviations."""
    airframe = replace(
        airframe,
        mass_share=factor * airframe.mass_share,
        inertia_share=factor * airframe.inertia_share,
        arm_share=factor * airframe.arm_share,
    )
    return airframe, replace(sensor_error_model(AIRCRAFT), errors=true_errors().scaled(factor))


def analysed(flight: VirtualFlight, seed: int, factor: float) -> Row:
    """Return error and half-width of each derivative, and what the check says of the file."""
    columns, _ = even_columns(flight.table)
    expected = truths(list(flight.maneuvers))
    airframe, data = claimed(drawing(expected, seed), factor)
    row: Row = {"intervals": {}, "check": {}, "doubted": False}
    try:
        found = reconstruct(columns, airframe, data)
        row["check"] = {
            c.name: [c.rms_ratio, c.degrees_of_freedom, c.probability]
            for c in found.calibration_tests
        }
        row["doubted"] = found.calibration_tests[0].rejected
    except IdentificationError as error:
        row["failed"] = str(error)  # no check, so no doubt
    try:
        known = replace(aircraft_data(AIRCRAFT), airframe=airframe, instrument=data)
        answer = identify_columns(
            at_hand(columns, aircraft=known), models="coefficients"
        ).coefficients
    except IdentificationError as error:
        return row | {"failed": str(error)}
    assert answer is not None
    for c in answer.coefficients:
        if c.name in COUNTED:
            row["intervals"][c.name] = [c.value - expected[c.name], c.half_width]
    return row


def fly(card: str, seeds: Sequence[int], kept: Path) -> Iterator[Row]:
    """Return a row per flight and file: those kept, then those flown now."""
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept.is_file() else []
    done = {(row["card"], row["seed"]) for row in rows}
    yield from (row for row in rows if row["card"] == card and row["seed"] in seeds)
    for seed in seeds:
        if (card, seed) in done:
            continue
        flight = virtual_flight(every_tolerance(card), seed, errors=true_errors())
        fresh = [
            {"card": card, "seed": seed, "file": name, **analysed(flight, seed, factor)}
            for name, factor in CLAIMS.items()
        ]
        with kept.open("a", encoding="utf-8") as out:
            out.writelines(json.dumps(row) + "\n" for row in fresh)
        yield from fresh


def lines(rows: Sequence[Row]) -> list[str]:
    """Return coverage and alarms of each file, then of each derivative and group."""
    result = []
    for name in CLAIMS:
        own = [row for row in rows if row["file"] == name]
        pairs = [(n, *p) for row in own for n, p in row["intervals"].items()]
        inside = np.array([abs(miss) <= half for _, miss, half in pairs])
        doubted = [bool(row["doubted"]) for row in own]
        if not len(inside):
            continue
        result.append(
            f"{name}: {len(own)} flights, covered {100 * inside.mean():.1f} % of {len(inside)};"
            f" doubted in {sum(doubted)} ({100 * np.mean(doubted):.0f} %);"
            f" failed {sum('failed' in row for row in own)}"
        )
        for derivative in COUNTED:
            hit = [abs(miss) <= half for n, miss, half in pairs if n == derivative]
            result.append(f"  {derivative:9s} {100 * np.mean(hit):5.1f} %")
        for group in sorted({g for row in own for g in row["check"]}):
            tests = [row["check"][group] for row in own if group in row["check"]]
            times = np.array([t for t, n, _ in tests if n])
            if len(times):
                alarms = np.mean([p < 0.01 for _, n, p in tests if n])
                rms = np.sqrt(np.mean(times**2))
                result.append(
                    f"  {group:18s} found in {len(times)} flights, rms {rms:.2f} times the file's,"
                    f" alone doubted in {100 * alarms:.0f} %"
                )
    return result


def main(arguments: list[str] | None = None) -> int:
    """Fly what is missing, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=FLIGHTS)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--card", default="survey")
    parser.add_argument(
        "--rows", type=rows_file, default=Path("../build/study/instrument_honesty.jsonl")
    )
    options = parser.parse_args(arguments)
    options.rows.parent.mkdir(parents=True, exist_ok=True)
    seeds = range(options.first, options.first + options.flights)
    rows: list[Row] = []
    for row in fly(options.card, seeds, options.rows):
        rows.append(row)
        sys.stderr.write(f"{row['seed']} {row['file']}: doubted {row['doubted']}\n")
    sys.stdout.write("\n".join(lines(rows)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
