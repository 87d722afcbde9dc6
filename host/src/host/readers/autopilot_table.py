"""A log of another autopilot as columns to identify from, refused where nothing can be."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from host.physical.recording import AUTOPILOT, SURFACES, Recording
from host.readers.autopilot_flight import CLOCK_SHARE, read_autopilot
from host.readers.foreign_tables import Foreign


def autopilot_table(source: Path, sensors: Mapping[str, int] | None) -> Foreign:
    """Return the columns of a log of PX4 or ArduPilot.

    Surfaces are commands: shares of full travel under the names of angles, so that one is full
    travel until an aircraft file says how far that is. They stand under ``elevator_share`` too, for
    a map.

    Raises
    ------
    host.errors.HostError
        If it cannot be read, or nothing can be identified of it.
    """
    flight = read_autopilot(source, sensors)
    flight.refuse()
    columns = flight.columns()
    shares = flight.shares
    columns |= {f"{name}_rad": columns[f"{name}_share"] for name in shares}
    commanded = tuple(name for name in SURFACES if name in shares)
    return Foreign(
        columns,
        notes=flight.notes(),
        recording=Recording(commanded, CLOCK_SHARE, AUTOPILOT, flight.imu_lag_s),
        shares=shares,
        slow_outputs=flight.undersampled(),
    )
