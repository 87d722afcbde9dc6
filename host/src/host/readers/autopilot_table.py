"""A log of another autopilot as columns to identify from, refused where nothing can be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from host.physical.recording import AUTOPILOT, SURFACES, Recording
from host.readers.autopilot_flight import CLOCK_SHARE, read_autopilot
from host.readers.autotune_model import tuned_models
from host.readers.foreign_tables import Foreign
from host.readers.px4_channels import torque_setpoints


def autopilot_table(
    source: Path, sensors: Mapping[str, int | str] | None, flight: int | None = None
) -> Foreign:
    """Return the columns of a log of PX4 or ArduPilot.

    Surfaces are commands: shares of full travel under the names of angles, so that one is full
    travel until an aircraft file says how far that is. They stand under ``elevator_share`` too, for
    a map.

    Raises
    ------
    host.errors.HostError
        If it cannot be read, or nothing can be identified of it.
    """
    read = read_autopilot(source, sensors, flight)
    read.refuse()
    notes, shares = read.notes(), read.shares
    tuned = tuned_models(read.log, read.channels.signals, torque_setpoints(read.log))
    # What is read of the messages is in the channels; of a large log both are too much.
    read = replace(read, log=replace(read.log, messages={}))
    columns = read.columns()
    columns |= {f"{name}_rad": columns[f"{name}_share"] for name in shares}
    commanded = tuple(name for name in SURFACES if name in shares)
    return Foreign(
        columns,
        notes=notes,
        recording=Recording(commanded, CLOCK_SHARE, AUTOPILOT, read.imu_lag_s),
        shares=shares,
        slow_outputs=read.undersampled(),
        tuned=tuned,
    )
