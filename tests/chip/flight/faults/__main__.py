"""Inject the faults an aircraft may meet into the flight image and print what came of each.

    make faults                       the table
    make faults FAULTS="--only IMU"   rows whose text holds this
    make faults FAULTS="--during-input"   in flight while a row teaches, then while one holds

Simulation only. Every fault starts from the same state, in flight with the Mega driving; the log is
decoded and the file system checked afterwards; the table is run with the threshold of the relay's
transistor at both ends of its data sheet. Power cuts (6) are `make power-cuts`.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from flight.faults.boot import run_boots
from flight.faults.model import Fault, Outcome
from flight.faults.rows import FAULTS
from flight.faults.run import ready_rig, run_fault
from flight.faults.strange import run_strange
from flight.faults.swapped import run_swaps
from flight.flown_row import HOLDS, TEACHES, RowCard, input_rig
from flight.images import build_image
from flight.rig import THRESHOLDS_VOLT
from simavr_bench import in_fork
from simavr_bench.heartbeat import LEAST_GATE_VOLT


def line(fault: Fault, seen: Outcome) -> str:
    """Lay out one row."""
    gap = f"{seen.gap_ms:.0f}" if fault.servos else "-"
    back = f"{seen.recovered_s:.2f}" if seen.recovered_s == seen.recovered_s else "-"
    said = "NOT: " + "; ".join(seen.wrong) if seen.wrong else ", ".join(seen.said) or "nothing"
    return (
        f"{fault.number:3} {fault.injected:31} {fault.expected:33} {gap:>4} {seen.lost:5} "
        f"{back:>6} {seen.beats.gate_volt:5.2f}  {said}"
    )


def run_table(
    elf: Path, folder: Path, threshold_volt: float, flown: RowCard | None, *, only: str
) -> tuple[int, float]:
    """Print every row with one transistor; gives the wrong ones and the lowest gate voltage."""
    meanwhile = f", while a row {flown.does}" if flown else ""
    print(f"threshold of the relay's transistor {threshold_volt} V{meanwhile}")
    head = f"{'injected':31} {'expected':33} {'gap':>4} {'lost':>5} {'back':>6} {'gate':>5}"
    print(f"{'#':3} {head}  seen in the log", flush=True)
    row = None
    if flown:
        rig, journal, row = input_rig(elf, folder, flown, threshold_volt=threshold_volt)
    else:
        rig, journal = ready_rig(elf, folder, threshold_volt=threshold_volt)
    bad, gate_volt = 0, float("inf")
    for fault in FAULTS:
        if only not in fault.injected:
            continue
        seen = in_fork(partial(run_fault, rig, journal, fault, folder, row))
        bad += bool(seen.wrong)
        gate_volt = float(np.fmin(gate_volt, seen.beats.gate_volt))
        print(line(fault, seen), flush=True)
    if flown:  # a card that is swapped is one that was pulled, until the ground
        return bad, gate_volt
    more, volt = run_swaps(rig, journal, only=only)
    return bad + more, min(gate_volt, volt)


def main() -> int:
    """Print the tables; 0 if every row is as expected, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", default="", help="rows whose text holds this")
    parser.add_argument(
        "--during-input", action="store_true",
        help="while a row of a flight card teaches, and while one holds",
    )  # fmt: skip
    parser.add_argument(
        "--threshold", type=float, choices=THRESHOLDS_VOLT, help="of one transistor only, V"
    )
    options = parser.parse_args()
    bad = 0
    volts = []
    print("gap: longest of any servo, ms; lost: identification frames; back: s from its end;")
    print(f"gate: lowest at the pump's worst tolerances and 4.5 V, V (at least {LEAST_GATE_VOLT})")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        elf = Path(shutil.copy(build_image("mega2560"), folder / "firmware.elf"))
        rows = (TEACHES, HOLDS) if options.during_input else (None,)
        for threshold_volt, flown in product(THRESHOLDS_VOLT, rows):
            if options.threshold not in (None, threshold_volt):
                continue
            wrong, volt = run_table(elf, folder, threshold_volt, flown, only=options.only)
            bad += wrong
            volts.append(volt)
        if not options.during_input:
            print("cards at power-on")
            bad += run_boots(elf, folder, only=options.only)
            wrong, volt = run_strange(elf, folder, only=options.only)
            bad += wrong
            volts.append(volt)
    print(f"lowest gate voltage {min(volts):.2f} V, limit {LEAST_GATE_VOLT} V")
    print(f"{bad} rows are not as expected")
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
