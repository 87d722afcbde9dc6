"""Second act of `make demo`: fly a virtual aircraft, identify it, compare with the truth.

Only verbs a user has. All of it is simulated on this computer. Results stay in build/demo/virtual.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = Path("build") / "demo" / "virtual"
HOST = [sys.executable, "-m", "host"]


def step(what: str, *arguments: str) -> int:
    """Say what comes, run one verb, give its exit code."""
    print(f"demo: {what}", file=sys.stderr)
    print(f"demo: host {' '.join(arguments)}", file=sys.stderr, flush=True)
    return subprocess.run([*HOST, *arguments], cwd=ROOT, check=False).returncode


def main() -> int:
    """Fly and identify; 0 if both went well, else 6."""
    log = str(OUT / "flight.bin")
    flown = step(
        "flying a card of doublets and 3-2-1-1s with a virtual aircraft through the recorder",
        *("simulate", "demo", "-o", str(OUT)),
    )
    if flown != 0:
        return 6
    identified = step(
        "identifying the aircraft from its log, beside the truth only the simulation knows",
        *("identify", log, "--calibration", str(OUT / "calibration.toml")),
        *("--aircraft", "ultrastick25e", "--truth", str(OUT / "flight.truth.toml")),
        *("--plots", str(OUT / "plots")),
    )
    if identified not in (0, 3):
        return 6
    print(f"\nLook at {OUT / 'flight.png'} and at the pictures in {OUT / 'plots'}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
