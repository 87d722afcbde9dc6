"""A short selection of `make faults`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from flight.rig import FlightRig

CHOSEN = ("card busy 500 ms", "block refused twice", "IMU dies holding SCL", "watchdog reset")


@pytest.mark.parametrize("injected", CHOSEN)
def test_fault_in_flight(flying: FlightRig, tmp_path: Path, injected: str) -> None:
    from collections import Counter

    from flight.faults import FAULTS, Outcome, run_fault, verdict
    from simavr_bench import in_fork

    fault = next(fault for fault in FAULTS if fault.injected == injected)
    seen = in_fork(lambda: run_fault(flying, fault, tmp_path))
    boot = Counter({"reset": 1, "imu_found": 1})
    assert verdict(fault, seen, Outcome(0.0, 0, True, True, boot)) == []
