"""Which calibration made the columns of a log, and which of them rest on default numbers."""

from __future__ import annotations

from typing import Any

from host.log.flight_log import FlightLog
from host.physical.columns import ANALOGUE, COLUMNS, INERTIAL, RESTS_ON


def calibration_note(log: FlightLog) -> dict[str, Any]:
    """Return which calibration was used and which columns rest on default numbers."""
    defaults = set(log.calibration.defaults())
    return {
        "name": log.calibration.name,
        "date": log.calibration.date,
        "default_columns": [
            column.name for column in COLUMNS if defaults & set(_rests_on(log, column.name))
        ],
    }


def _rests_on(log: FlightLog, column: str) -> tuple[str, ...]:
    for name, (own, line) in ANALOGUE.items():
        del name
        if own == column:
            return (line,)
    for own, kind, _ in INERTIAL.values():
        if own == column:
            return (f"imu.{kind}",)
    surface = column.removesuffix("_rad")
    if surface in log.inputs:
        if log.inputs[surface] == "commanded":
            return (f"pulse.{surface}",)
        pots = {"aileron": ("channel.pot_aileron_left", "channel.pot_aileron_right")}
        return pots.get(surface, (f"channel.pot_{surface}",))
    if column == "throttle":
        return ("pulse.throttle",)
    return RESTS_ON.get(column, ())
