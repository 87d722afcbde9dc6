"""Settings of the logger that the checks need: as received, before that those of this host."""

from __future__ import annotations

import tomllib
from functools import cache
from typing import Any

from host.preflight.sample import SlowReading
from host.resources import resource

NO_GPS = "none"


@cache
def _shipped() -> dict[str, Any]:
    """Return the values of firmware/settings.toml."""
    tables = tomllib.loads(resource("settings.toml").read_text(encoding="utf-8"))
    return {name: table["value"] for name, table in tables.items()}


class PilotSettings:
    """Thresholds of switch and throttle, and whether there is a GPS.

    Attributes
    ----------
    direct_max_us, mega_min_us, idle_max_us : float
        Switch at or below is direct, at or above is the Mega; throttle at or below is idle.
    gps : bool
        Whether positions are expected.
    """

    def __init__(self) -> None:
        shipped = _shipped()
        self.direct_max_us = float(shipped["switch_direct_max_us"])
        self.mega_min_us = float(shipped["switch_mega_min_us"])
        self.idle_max_us = float(shipped["throttle_idle_max_us"])
        self.gps = shipped["gps_source"] != 0

    def take_reading(self, reading: SlowReading) -> None:
        """Take the settings of the logger."""
        if reading.name != "config":
            return
        said = reading.said
        self.direct_max_us = float(said["switch_direct_max_us"])
        self.mega_min_us = float(said["switch_mega_min_us"])
        self.idle_max_us = float(said["throttle_idle_max_us"])
        self.gps = said["gps_source"] != NO_GPS
