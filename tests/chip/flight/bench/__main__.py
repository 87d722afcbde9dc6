"""Run the bench: ``python -m flight.bench --help``."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

from compilers import TESTED
from disassembly import ImageError
from flight.bench.fly import FlightError, fly
from flight.bench.inputs import FRAMES_S, ROW_S, fly_input
from flight.bench.plan import STALL_S
from flight.bench.report import flight_rows, image_rows, input_rows
from flight.bench.table import Table
from flight.images import build_image


def main() -> int:
    """Print the tables; 0 if every limit holds, 6 if one does not, 1 if nothing was measured."""
    parser = argparse.ArgumentParser(
        prog="flight.bench",
        description="Measure the flight image on the simulated chip (simulation only).",
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="simulated (default 10)")
    parser.add_argument("--rate", type=int, action="append", choices=sorted(STALL_S))
    parser.add_argument("--elf", type=Path, help="another image than those of `pio run`")
    parser.add_argument("--gcc", action="append", choices=TESTED, help="compiler (default both)")
    parser.add_argument("--seed", type=int, default=1, help="of stalls, sticks and steps")
    asked = parser.parse_args()
    if asked.minutes < 0.5:
        parser.error(f"--minutes {asked.minutes:g}: at least 0.5, eight receivers share them")
    if asked.elf is not None and not asked.elf.is_file():
        parser.error(f"{asked.elf}: no such file; `pio run` makes .pio/build/mega2560/firmware.elf")
    table = Table()
    try:
        if asked.elf is not None:
            images = [asked.elf]
        else:
            images = [build_image("mega2560", gcc) for gcc in asked.gcc or TESTED]
        for elf in images:
            depth, room_bytes = image_rows(table, elf)
            with tempfile.TemporaryDirectory() as folder:
                for rate_hz in asked.rate or sorted(STALL_S):
                    flight = fly(
                        elf,
                        rate_hz=rate_hz,
                        minutes=asked.minutes,
                        folder=Path(folder),
                        seed=asked.seed,
                    )
                    flight_rows(table, flight, depth, room_bytes)
                    for holds, frame_s in product((False, True), FRAMES_S):
                        input_rows(
                            table,
                            fly_input(
                                elf,
                                rate_hz=rate_hz,
                                frame_s=frame_s,
                                duration_s=ROW_S,
                                folder=Path(folder),
                                holds=holds,
                            ),
                        )
    except (FlightError, ImageError) as error:
        print(f"flight.bench: {error}", file=sys.stderr)
        return 6
    except (OSError, RuntimeError, subprocess.CalledProcessError) as error:
        print(f"flight.bench: {error}", file=sys.stderr)
        return 1
    if table.missed:
        print(f"\nmissed: {', '.join(table.missed)}")
        return 6
    print("\nevery limit holds")
    return 0


if __name__ == "__main__":
    sys.exit(main())
