"""Inject the faults an aircraft may meet into the flight image and print what came of each.

    make faults                       the table
    make faults FAULTS="--only IMU"   rows whose text holds this

Simulation only. Every fault starts from the same state, in flight with the Mega driving; the log is
decoded and the file system checked afterwards. Power cuts (6) are `make power-cuts`.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from functools import partial
from pathlib import Path

from flight.faults.boot import run_boots
from flight.faults.model import Fault, Outcome
from flight.faults.rows import FAULTS
from flight.faults.run import ready_rig, run_fault
from flight.images import build_image
from simavr_bench import in_fork


def line(fault: Fault, seen: Outcome) -> str:
    """Lay out one row."""
    gap = f"{seen.gap_ms:.0f}" if fault.servos else "-"
    back = f"{seen.recovered_s:.2f}" if seen.recovered_s == seen.recovered_s else "-"
    said = "NOT: " + "; ".join(seen.wrong) if seen.wrong else ", ".join(seen.said) or "nothing"
    return (
        f"{fault.number:3} {fault.injected:31} {fault.expected:33} {gap:>4} {seen.lost:5} "
        f"{back:>6}  {said}"
    )


def main() -> int:
    """Print the table; 0 if every row is as expected, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", default="", help="rows whose text holds this")
    options = parser.parse_args()
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        elf = Path(shutil.copy(build_image("mega2560"), folder / "firmware.elf"))
        rig, journal = ready_rig(elf, folder)
        print("gap: longest of any servo, ms; lost: identification frames; back: s from its end")
        head = (
            f"{'injected':31} {'expected':33} {'gap':>4} {'lost':>5} {'back':>6}  seen in the log"
        )
        print(f"{'#':3} {head}", flush=True)
        for fault in FAULTS:
            if options.only not in fault.injected:
                continue
            seen = in_fork(partial(run_fault, rig, journal, fault, folder))
            bad += bool(seen.wrong)
            print(line(fault, seen), flush=True)
        bad += run_boots(elf, folder, only=options.only)
    print(f"{bad} rows are not as expected")
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
