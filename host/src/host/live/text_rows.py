"""Rows of text from the original logger, or from ours set to `ascii`: shown as they come.

They carry no time: each is placed where it arrived, or by the rate at which it is played again.
"""

from __future__ import annotations

import math

import numpy as np

from host.errors import HostError
from host.live.gps_fix import GpsFix
from host.live.height_over_start import HeightOverStart
from host.live.live_sample import LIVE_UNITS, Array, LiveUpdate
from host.original.printed_pulses import servo_us_of_printed, stick_us_of_servo
from host.original.row_table import make_table
from host.original.rows import OriginalRows, looks_like_rows, parse_rows
from host.people_units import people_columns
from host.physical.calibration import Calibration

_LONGEST = 4096
_LABELS = {
    "elevator": ("elevs",),
    "aileron": ("ails",),
    "rudder": ("rdrs", "ruds"),
    "throttle": ("throts",),
}


class TextRows:
    """Bytes in any portions in, rows out.

    Parameters
    ----------
    calibration : Calibration
    rate_hz : float, optional
        Rows a second, where they are played again.

    Attributes
    ----------
    rows : int
    variant : str
        One of `host.original.rows.VARIANTS`; empty before the first row.
    """

    def __init__(self, calibration: Calibration, rate_hz: float | None = None) -> None:
        self.rows = 0
        self.variant = ""
        self._calibration = calibration
        self._rate_hz = rate_hz
        self._held = bytearray()
        self._first_s: float | None = None
        self._last_s = 0.0
        self._height = HeightOverStart()
        self._position: tuple[float, ...] = ()

    def feed(self, data: bytes, arrived_s: float) -> LiveUpdate | None:
        """Take more of the stream; return the rows that it completes, None without any."""
        self._held += data
        end = max(self._held.rfind(b"\r"), self._held.rfind(b"\n")) + 1
        whole = bytes(self._held[:end])
        del self._held[:end]
        del self._held[:-_LONGEST]
        if not looks_like_rows(whole):
            return None
        try:
            printed = parse_rows(whole)
        except HostError:  # hardly more than fragments
            return None
        self.variant = printed.variant
        table = make_table(printed, self._calibration).columns
        count = len(printed)
        nothing = np.full(count, np.nan)
        read = people_columns(table) | _pulses(printed) | _airspeeds(printed)
        rows = {name: np.asarray(read.get(name, nothing), float) for name in LIVE_UNITS}
        rows["height_m"] = self._height.of(rows["altitude_m"])
        rows["t_s"] = self._times(count, arrived_s)
        fixes = self._fixes(printed, rows)
        return LiveUpdate(rows, np.ones(count, bool), 0, [], arrived_s, fixes=fixes)

    def _times(self, count: int, arrived_s: float) -> Array:
        """Return the time of each row, s; rows that arrive together share the time since before."""
        before = self.rows
        self.rows += count
        if self._rate_hz is not None:
            return np.arange(before, self.rows) / self._rate_hz
        if self._first_s is None:
            self._first_s = arrived_s
        now_s = max(arrived_s - self._first_s, self._last_s)
        times = self._last_s + (now_s - self._last_s) * np.arange(1, count + 1) / count
        self._last_s = now_s
        return times

    def _fixes(self, printed: OriginalRows, rows: dict[str, Array]) -> list[GpsFix]:
        """Return positions that differ from the one before: a row repeats the last."""
        labels = ("lat", "lon", "gpsgs", "gpsgc", "numsat", "fix")
        columns = [printed.values[label].tolist() for label in labels]
        height_m = printed.values.get("gpsalt", rows["altitude_m"]).tolist()
        found = []
        for at, said in enumerate(zip(*columns, strict=True)):
            if said == self._position or not math.isfinite(sum(said)):
                continue
            self._position = said
            latitude, longitude, speed, course, satellites, fix = said
            north, east = (speed * one(math.radians(course)) for one in (math.cos, math.sin))
            height = height_m[at] if math.isfinite(height_m[at]) else 0.0
            known = fix > 0.0
            found.append(
                GpsFix(
                    float(rows["t_s"][at]),
                    "fix_2d" if known else "none",
                    round(satellites),
                    (latitude, longitude, height) if known else None,
                    (north, east, 0.0),
                    speed,
                    course,
                )
            )
        return found


def _airspeeds(printed: OriginalRows) -> dict[str, Array]:
    """Return the speed of each side, printed in km/h."""
    labels = {"velocity": "a", "velocitya": "a", "velocityb": "b"}
    return {
        f"airspeed_{side}_mps": np.asarray(printed.values[label] / 3.6, float)
        for label, side in labels.items()
        if label in printed.values
    }


def _pulses(printed: OriginalRows) -> dict[str, Array]:
    """Return stick and servo behind the printed surfaces, us."""
    found: dict[str, Array] = {}
    for surface, labels in _LABELS.items():
        values = next(printed.values[one] for one in labels if one in printed.values)
        servo_us = servo_us_of_printed(values, surface)
        found[f"servo_{surface}_us"] = servo_us
        found[f"rc_{surface}_us"] = stick_us_of_servo(servo_us, surface)
    return found
