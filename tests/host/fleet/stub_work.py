"""What a child does in tests in place of identification, chosen by the name of its source."""

import os
import time
from pathlib import Path
from typing import Any

from host.errors import UsageError
from host.fleet.flight_task import IDENTIFIED, described

EATEN_BYTES = 600_000_000  # beyond any limit of the tests; no more, so that others keep theirs


def stub_row(values: dict[str, Any]) -> dict[str, Any]:
    """Return a row, unless the flight's name says to hang, eat memory, end or be damaged."""
    name = Path(values["source"]).stem
    if "hangs" in name:
        time.sleep(600.0)
    if "works" in name:
        while True:
            pass
    if "eats" in name:
        held = b"x" * EATEN_BYTES
        while held:  # and waits to be found with it
            time.sleep(600.0)
    if "ends" in name:
        os._exit(7)
    if "damaged" in name:
        raise UsageError("no intact block, expected a log")
    time.sleep(0.02)
    return {
        **described(values),
        "state": IDENTIFIED,
        "reason": "",
        "parameters": ["Cm_q"],
        "estimates": [-10.0],
        "own_covariance": [1.0],
        "errors": [],
        "error_sources": [],
        "loadings": [],
        "doubted": [],
        "verdict": [],
        "findings": "[]",
        "delays": "{}",
        "maneuvers": os.getpid(),
        "airspeed_mps": 17.0,
        "alpha_rad": 0.1,
        "lift": 0.3,
        "drag": 0.03,
        "mass_kg": 1.8,
        "cg_m": [0.0, 0.0, 0.0],
        "chord_m": 0.25,
        "span_m": 1.26,
        "processor_s": 0.02,
    }
