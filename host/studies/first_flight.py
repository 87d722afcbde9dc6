"""Fly and identify the flight of host/IDENTIFY.md, and make that page's pictures anew.

cd host && python -m studies.first_flight
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

from host.cli import main as host

PICTURES = Path(__file__).resolve().parents[1] / "pictures"
SHOWN = ("longitudinal_fit.svg", "longitudinal_intervals.svg")
DIGITS = re.compile(r"(\d+\.\d\d)\d+")  # a hundredth of a point is nothing to see


def main() -> int:
    """Run the page's commands in a folder of their own; keep the pictures it shows."""
    with tempfile.TemporaryDirectory() as name:
        flight = Path(name, "flight")
        code = host(["simulate", "demo", "-o", str(flight)])
        if code == 0:
            code = host([
                "identify", str(flight / "flight.bin"),
                "--calibration", str(flight / "calibration.toml"),
                "--aircraft", "ultrastick25e", "--plots", str(flight / "pictures"),
            ])  # fmt: skip
        if code:
            return code
        PICTURES.mkdir(exist_ok=True)
        for picture in SHOWN:
            text = (flight / "pictures" / picture).read_text(encoding="utf-8")
            (PICTURES / picture).write_text(DIGITS.sub(r"\1", text), encoding="utf-8")
    sys.stderr.write(f"wrote {len(SHOWN)} pictures in {PICTURES}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
