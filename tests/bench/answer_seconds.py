"""Seconds of the default answer to four kinds of records, in those of a fixed computation.

    .venv/bin/python tests/bench/answer_seconds.py    # two minutes of a quiet core

Five minutes of our own log, half a minute of thor75, nine records of 2.5 s cut from the log, and
180 s at 100 Hz without noise. Processor time of one process, its imports left out; the last column
divides it by that of the fixed computation of the same run, so that two machines compare.
"""

from __future__ import annotations

import os
import sys
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
import pandas as pd

import host
from tests.bench import identify_log
from tests.bench.fixed_work import seconds, unit_s

ROOT = Path(__file__).resolve().parents[2]
AIRCRAFT = "ultrastick25e"
THOR = ROOT / "tests" / "data" / "thor75"
FLOWN = THOR / "flight75_240_270.csv"
TRUE_FROM_S, TRUE_S, TRUE_HZ = 15.0, 180.0, 200
BEFORE_S, RECORD_S, RECORDS = 3.9, 2.5, 9  # a record begins so long before a maneuver's `start_s`
COLUMNS = (
    "t_s", "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2",
    "ay_mps2", "az_mps2", "phi_rad", "theta_rad", "psi_rad", "elevator_rad", "aileron_rad",
    "rudder_rad", "qbar_pa", "density_kgpm3",
)  # fmt: skip


def records(folder: Path) -> dict[str, Callable[[], object]]:
    """Fly the log; return the call of each answer."""
    identify_log.fly(folder, *identify_log.CASES[0][1:3])
    log = folder / "flight.bin"
    table = host.read_log(log).table()
    truth = tomllib.loads((folder / "flight.truth.toml").read_text(encoding="utf-8"))
    begins = [m["start_s"] - BEFORE_S for m in truth["maneuver"][:RECORDS]]
    cut = [table[(table.t_s >= s) & (table.t_s < s + RECORD_S)][list(COLUMNS)] for s in begins]
    with np.load(folder / "flight.truth.npz") as true:
        rows = slice(int(TRUE_FROM_S * TRUE_HZ), int((TRUE_FROM_S + TRUE_S) * TRUE_HZ), 2)
        clean = pd.DataFrame({name: true[name][rows] for name in COLUMNS})
    return {
        "five minutes of our log": lambda: host.identify(
            log, aircraft=AIRCRAFT, calibration=folder / "calibration.toml"
        ),
        "30 s of thor75": lambda: host.identify(FLOWN, mapping=THOR / "map.toml"),
        "nine records of 2.5 s": lambda: host.identify(cut),
        "180 s without noise": lambda: host.identify(clean),
    }


def main() -> int:
    """Print a line for each kind of record."""
    host.identify(FLOWN, mapping=THOR / "map.toml", from_s=241.0, methods="equation-error")
    one_s = unit_s()
    print(f"{'default answer to':<28}{'s':>8}{'units':>8}   (a unit: {one_s:.2f} s)")
    with tempfile.TemporaryDirectory() as name:
        for what, answer in records(Path(name)).items():
            took_s = seconds(answer)
            print(f"{what:<28}{took_s:>8.2f}{took_s / one_s:>8.2f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
