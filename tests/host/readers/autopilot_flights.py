"""One virtual flight, written as PX4 and ArduPilot planes of three airframes had logged it."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd
from host.readers.dataflash_binary import BinaryRecords
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome.autopilot_logs import NAMES, write_autopilot_log
from host.twin.outcome.ideal import true_table
from host.twin.sensors.local_flow import AirData, air_data
from host.twin.testcard import cards
from numpy.typing import NDArray

CARD = {
    "format": 1,
    "aircraft": "ultrastick25e",
    "flight": {"ground_s": 3.0},
    "air": {"turbulence_mps": 0.2},
    "segment": [
        {"kind": "trim", "duration_s": 2.0},
        {"kind": "3211", "axis": "elevator", "width_s": 0.25, "amplitude": 4.0, "repeat": 3},
        {"kind": "doublet", "axis": "aileron", "width_s": 0.4, "amplitude": 4.0, "repeat": 2},
        {"kind": "doublet", "axis": "rudder", "width_s": 0.5, "amplitude": 5.0, "repeat": 2},
    ],
}
FORMATS = tuple(NAMES)
FULL_TRAVEL_RAD = 0.4363323  # of every surface of the Ultra Stick


@cache
def flown() -> tuple[FlightRecord, AirData]:
    """Return the flight."""
    record = fly(cards.parse(CARD, "autopilots"), seed=4)
    return record, air_data(record)


@cache
def truth() -> pd.DataFrame:
    """Return what was true."""
    return true_table(*flown())


def write(kind: str, folder: Path, airframe: str = "conventional") -> Path:
    """Write the flight's log of a format."""
    record, data = flown()
    return write_autopilot_log(kind, record, data, folder / "flight", airframe=airframe)


def rows_of(found: BinaryRecords, number: int) -> dict[str, NDArray[Any]]:
    """Return all fields of all records of a kind."""
    return found.rows(found.kinds[number], found.places[number])
