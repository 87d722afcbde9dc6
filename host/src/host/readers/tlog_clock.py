"""Time since the autopilot's start in messages that a ground station received."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array, IntArray
from host.readers.clock_epochs import clock_sets

Fields = dict[str, NDArray[Any]]
WRAP_US = float(1 << 32)
OTHER_CLOCK_S = 1e9  # a time since boot is shorter than thirty years
STAMP = "received_s"  # of the ground station, besides a message's own fields
PLACE = "place"  # of a message's frame in the log
BOTH_CLOCKS = "ATTITUDE"  # has both clocks, so it dates the autopilot's start


class Station:
    """The clock of the ground station, and the instants of it at which the autopilot's was 0.

    There are several where the station's clock was set: from each place in the log on another.
    """

    def __init__(self, tables: Mapping[str, Fields], remarks: list[str]) -> None:
        both = tables.get(BOTH_CLOCKS, {})
        self._places: IntArray = np.zeros(0, dtype=np.int64)
        if not len(both.get(STAMP, ())):
            every = [fields[STAMP] for fields in tables.values() if len(fields.get(STAMP, ()))]
            self._boots_s = np.array([min((float(s.min()) for s in every), default=0.0)])
            return
        started = both[STAMP] - both["time_boot_ms"] * 1e-3
        sets = clock_sets(started)
        self._boots_s = np.array([np.median(part) for part in np.split(started, sets)])
        self._places = both[PLACE][sets].astype(np.int64)
        for row, change_s in zip(sets.tolist(), np.diff(self._boots_s).tolist(), strict=True):
            remarks.append(
                f"the ground station's clock was set by {change_s:+.1f} s at"
                f" {both['time_boot_ms'][row] * 1e-3:.1f} s: taken out of the messages that it"
                " timed"
            )

    def since_boot_s(self, stamps: Array, places: IntArray) -> Array:
        """Return times since boot of messages by their time of reception."""
        return np.asarray(stamps - self._boots_s[np.searchsorted(self._places, places, "right")])


def own_times(name: str, fields: Fields) -> Array | None:
    """Return times since boot of messages that say it themselves."""
    if "time_boot_ms" in fields:
        return np.asarray(fields["time_boot_ms"] * 1e-3, dtype=np.float64)
    if STAMP in fields or "time_usec" not in fields:
        return None
    own_us = np.asarray(fields["time_usec"], dtype=np.float64)
    if name == "SERVO_OUTPUT_RAW":  # 32 bits
        own_us = np.unwrap(own_us, period=WRAP_US)
    return own_us * 1e-6


def message_times(name: str, fields: Fields, station: Station) -> Array:
    """Return times since boot: a message's own where it has one."""
    own_s = own_times(name, fields)
    places, stamps = fields.pop(PLACE), fields.pop(STAMP, None)
    for stamp in ("time_boot_ms", "time_usec"):
        fields.pop(stamp, None)
    if own_s is not None:
        return own_s
    return station.since_boot_s(np.asarray(stamps, dtype=np.float64), places)
