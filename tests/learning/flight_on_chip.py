"""Whole rows of virtual flights through the C++ on the simulated ATmega2560, bit for bit.

    PYTHONPATH=host python -m tests.learning.flight_on_chip 22006 22007

Flies the study's card through the recorder, takes the rows of pitch, roll and yaw out of its log,
lets the host answer every solve of them and the chip as well; flags are those of the Mega's image.
Wants avr-g++ and simavr; a minute a flight.
"""

from __future__ import annotations

import argparse
import configparser
import subprocess
import sys
import tempfile
from pathlib import Path

from host.planning.onboard_sums import PITCH, ROLL, YAW
from studies.onboard_learning import flown, learning_rows

from tests.learning.shared_cases import Case, header

ROOT = Path(__file__).parents[2]
SUITE = ROOT / "tests/firmware/test_learning"
CHIP = ("-mmcu=atmega2560", "-DF_CPU=16000000L", "-std=gnu++14", "-fno-exceptions")
ROWS = {"pitch, multisine": PITCH, "roll, multisine": ROLL, "yaw, multisine": YAW}
MOST_S = 300


def cases_of(seed: int) -> list[Case]:
    """Return the rows of one flight."""
    rows = {row.name: row for row in learning_rows(flown(seed))}
    return [Case(axis.capitalize(), rows[n].card, rows[n].samples) for n, axis in ROWS.items()]


def built(cases: list[Case], folder: Path) -> Path:
    """Return a program of the chip that replays the cases."""
    (folder / "cases.h").write_text(header(cases), encoding="ascii")
    (folder / "replay.h").write_bytes((SUITE / "replay.h").read_bytes())
    ini = configparser.ConfigParser(inline_comment_prefixes=(";",))
    ini.read(ROOT / "platformio.ini")
    flags = [f for f in ini["env:mega2560"]["build_flags"].split() if f.startswith(("-O", "-f"))]
    sources = [
        *(ROOT / "firmware/core/learning").glob("*.cpp"),
        ROOT / "tests/firmware/check_main.cpp",
        ROOT / "tests/learning/flight_on_chip.cpp",
    ]
    where = [f"-I{p}" for p in (folder, ROOT / "firmware", ROOT / "protocol", SUITE.parent)]
    program = folder / "replay.elf"
    subprocess.run(
        ["avr-g++", *CHIP, *flags, *where, *map(str, sources), "-o", str(program), "-lm"],
        check=True,
    )
    return program


def main(arguments: list[str] | None = None) -> int:
    """Replay flights; 1 if the chip said anything else than the host."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+")
    wrong = 0
    for seed in parser.parse_args(arguments).seeds:
        cases = cases_of(seed)
        with tempfile.TemporaryDirectory() as folder:
            program = built(cases, Path(folder))
            said = subprocess.run(
                ["simavr", "-m", "atmega2560", "-f", "16000000", str(program)],
                capture_output=True, text=True, timeout=MOST_S, check=False,
            )  # fmt: skip
        lines = [line for line in (said.stdout + said.stderr).splitlines() if "check: " in line]
        same = sum("check: pass" in line for line in lines)
        wrong += same != len(cases)
        samples = sum(len(c.rows) for c in cases)
        print(f"seed {seed}: {same} of {len(cases)} rows, {samples} samples: every bit the same")
        print("\n".join(line for line in lines if "note" in line or "fail" in line))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
