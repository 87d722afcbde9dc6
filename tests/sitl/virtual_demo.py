"""`make demo`: fly a virtual aircraft through the recorder, compare, decode, identify, draw.

Only verbs a user has. All of it is simulated on this computer. Results stay in build/demo. Exit
codes: 0 all went well, 6 a step failed or the decoded log is not what the sensors explain.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = Path("build") / "demo"
HOST = [sys.executable, "-m", "host"]


def step(what: str, *arguments: str) -> int:
    """Say what comes, run one verb, give its exit code."""
    print(f"demo: {what}", file=sys.stderr)
    print(f"demo: host {' '.join(arguments)}", file=sys.stderr, flush=True)
    return subprocess.run([*HOST, *arguments], cwd=ROOT, check=False).returncode


def main() -> int:
    """Build, fly, decode, identify; 0 if all went well, else 6."""
    log, calibration = str(OUT / "flight.bin"), str(OUT / "calibration.toml")
    print("demo: building the recorder for this computer", file=sys.stderr, flush=True)
    build = [sys.executable, "firmware/toolchain/build_sitl.py"]
    if subprocess.run(build, cwd=ROOT, stdout=subprocess.DEVNULL, check=False).returncode != 0:
        print("demo: it does not build; the compiler's words stand above", file=sys.stderr)
        return 6
    flown = step(
        "flying a card of doublets and 3-2-1-1s with a virtual aircraft through the recorder",
        *("simulate", "demo", "-o", str(OUT)),
    )
    if flown != 0:
        return 6
    decoded = step(
        "decoding its log as its owner would",
        *("decode", log, "--calibration", calibration, "-o", str(OUT / "flight.csv")),
    )
    if decoded != 0:
        return 6
    identified = step(
        "identifying the aircraft from its log, beside the truth only the simulation knows",
        *("identify", log, "--calibration", calibration),
        *("--aircraft", "ultrastick25e", "--truth", str(OUT / "flight.truth.toml")),
        *("--model", "longitudinal", "--model", "lateral", "--model", "coefficients"),
        *("--plots", str(OUT / "plots")),
    )
    if identified not in (0, 3):
        return 6
    print(f"\nLook at {OUT / 'flight.png'} and at the pictures in {OUT / 'plots'}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
