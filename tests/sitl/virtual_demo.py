"""`make demo`: fly a virtual aircraft through the recorder, decode, identify, open the report.

    make demo DEMO=--no-open

Only verbs a user has. All of it is simulated on this computer. Results stay in build/demo. Exit
codes: 0 all went well, 6 a step failed or the decoded log is not what the sensors explain.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = Path("build") / "demo"
PAGE = OUT / "flight.report.html"
HOST = [sys.executable, "-m", "host"]
FAILED = 6
SHOWN = ("losses", "clock", "GPS")  # lines of a step that went well


def step(*arguments: str, shown: bool = False) -> bool:
    """Say and run one verb; what it prints is shown whole where that is asked or where it fails."""
    print(f"demo: host {' '.join(arguments)}", file=sys.stderr, flush=True)
    if shown:
        return subprocess.run([*HOST, *arguments], cwd=ROOT, check=False).returncode in (0, 3)
    ran = subprocess.run(
        [*HOST, *arguments], cwd=ROOT, check=False, text=True, encoding="utf-8",
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    lines = ran.stdout.splitlines()
    few = [line for line in lines if line.startswith(SHOWN)]
    for line in few if ran.returncode == 0 else lines:
        print(line, flush=True)
    return ran.returncode == 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly, decode, report, open the page; 0 if all went well, else 6."""
    parser = argparse.ArgumentParser(prog="make demo", description=__doc__)
    parser.add_argument("--no-open", action="store_true", help="leave the browser alone")
    asked = parser.parse_args(arguments)
    log, calibration = str(OUT / "flight.bin"), str(OUT / "calibration.toml")
    build = [sys.executable, "firmware/toolchain/build_sitl.py"]
    if subprocess.run(build, cwd=ROOT, stdout=subprocess.DEVNULL, check=False).returncode != 0:
        print("demo: the recorder does not build; the compiler's words stand above")
        return FAILED
    went_well = (
        step("simulate", "demo", "-o", str(OUT))
        and step("decode", log, "--calibration", calibration, "-o", str(OUT / "flight.csv"))
        and step(
            *("report", log, "--calibration", calibration, "--aircraft", "ultrastick25e"),
            *("--truth", str(OUT / "flight.truth.toml"), "-o", str(PAGE)),
            shown=True,
        )
    )
    if not went_well:
        return FAILED
    if not asked.no_open and "CI" not in os.environ and sys.stdout.isatty():
        webbrowser.open((ROOT / PAGE).as_uri())
    print(f"Open {PAGE}: the answer, and the truth that only the simulation knows.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
