"""Checks of GPS and static pressure."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from host.preflight.check import Check
from host.preflight.pilot_settings import PilotSettings
from host.preflight.sample import Sample, SlowReading

NO_PROOF = "no GPS and no pitot: no row of a flight card starts"


class GpsCheck(Check):
    """GPS gives a fresh three-dimensional fix, at rest.

    Parameters
    ----------
    settings : PilotSettings
    pitots : bool
        A pitot is on the list: it too tells the logger that the aircraft flies.
    """

    def __init__(self, settings: PilotSettings, *, pitots: bool = True) -> None:
        super().__init__("gps", "GPS fix", "nothing: open sky, up to a minute after power-on")
        self._settings, self._pitots = settings, pitots
        self._since_s: float | None = None
        self._heard_s: float | None = None
        self._first_s: float | None = None
        self._last_itow: int | None = None
        self._new_s = 0.0
        self._lead = ""
        self._errors: tuple[float, int] | None = None

    def take(self, sample: Sample) -> None:
        """Look at its age."""
        if not self._settings.gps:
            if not self._pitots:
                self.title = NO_PROOF
            self.pass_check()  # the settings expect none
            return
        if self._first_s is None:
            self._first_s = sample.t_s
        since_s = self._first_s if self._heard_s is None else self._new_s
        age_s = sample.t_s - since_s
        if age_s <= self.limit["stale_s"]:
            return
        self._since_s = None
        if self._heard_s is None:
            self.fail_check(f"nothing heard of it for {age_s:.0f} s: antenna, plug, TX and RX")
        elif sample.t_s - self._heard_s > self.limit["stale_s"]:
            self.fail_check(f"stale: it went silent {sample.t_s - self._heard_s:.0f} s ago")
        else:
            self.fail_check(f"stale: the same solution for {age_s:.0f} s")

    def take_reading(self, reading: SlowReading) -> None:
        """Take a solution, or its count of wrong messages."""
        if reading.name == "gps":
            self._solution(reading)
        elif reading.name == "system":
            self._garbled(reading)

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return self.reason or "no solution came"

    def _garbled(self, reading: SlowReading) -> None:
        count = reading.said["gps_errors"]
        if self._errors is not None:
            span_s = reading.t_s - self._errors[0]
            rate = ((count - self._errors[1]) % 65536) / max(span_s, 1.0)
            self._lead = ""
            if span_s > 2.5 and rate > self.limit["garbled_per_s"]:
                self._since_s = None
                self._lead = f"{rate:.0f} of its messages a second are damaged: its lead, its baud"
                self.fail_check(self._lead)
        else:
            self._errors = reading.t_s, count

    def _solution(self, reading: SlowReading) -> None:
        said = reading.said
        self._heard_s = reading.t_s
        if said["itow_ms"] == self._last_itow:
            return
        self._last_itow, self._new_s = said["itow_ms"], reading.t_s
        wrong = self._wrong(said)
        if wrong:
            self._since_s = None
            self.fail_check(wrong)
            return
        if self._lead:
            return
        if self._since_s is None:
            self._since_s = reading.t_s
        self.values = {
            "satellites": float(said["satellites"]),
            "h_accuracy_m": said["h_accuracy"] or math.nan,
        }
        if reading.t_s - self._since_s >= self.limit["hold_s"]:
            self.pass_check()
        elif self.state != "seen":
            self.keep_waiting("a fix, watched for a moment")

    def _wrong(self, said: dict[str, Any]) -> str:
        if said["fix"] != "fix 3d":
            return f"no fix ({said['fix']}, {said['satellites']} satellites): open sky, wait"
        latitude, longitude = said["latitude"], said["longitude"]
        if latitude is None or longitude is None or abs(latitude) > 90.0 or abs(longitude) > 180.0:
            return f"a place that cannot be: {latitude} deg north, {longitude} deg east"
        if said["satellites"] < self.limit["satellites"]:
            return f"{said['satellites']} satellites only: wait, open sky"
        accuracy, speed = said["h_accuracy"], said["ground_speed"]
        if accuracy is not None and accuracy > self.limit["accuracy_m"]:
            return f"known to {accuracy:.0f} m only: wait"
        if speed is not None and speed > self.limit["speed_mps"]:
            return f"says {speed:.1f} m/s while the aircraft stands"
        return ""


class BaroCheck(Check):
    """Static pressure is fresh, within the possible range, and noisy as a live sensor is."""

    def __init__(self) -> None:
        super().__init__("baro", "barometer", "nothing")
        self._first_s: float | None = None
        self._heard_s: float | None = None
        self._since_s: float | None = None
        self._bus = ""
        self._recent: deque[int] = deque(maxlen=int(self.limit["same"]))
        self._errors: tuple[float, int] | None = None

    def take(self, sample: Sample) -> None:
        """Look at its age."""
        if self._first_s is None:
            self._first_s = sample.t_s
        age_s = sample.t_s - (self._first_s if self._heard_s is None else self._heard_s)
        if age_s > self.limit["stale_s"]:
            self._since_s = None
            known = "nothing heard of it" if self._heard_s is None else "stale: it went silent"
            self.fail_check(f"{known} for {age_s:.0f} s: its bus, its plug")

    def take_reading(self, reading: SlowReading) -> None:
        """Take a pressure, or its count of errors."""
        said = reading.said
        if reading.name == "system":
            if self._errors is None:
                self._errors = reading.t_s, said["baro_errors"]
            span_s = reading.t_s - self._errors[0]
            rate = ((said["baro_errors"] - self._errors[1]) % 65536) / max(span_s, 1.0)
            self._bus = ""
            if span_s > 2.5 and rate > self.limit["errors_per_s"]:
                self._bus = f"{rate:.0f} errors a second on its bus"
                self.fail_check(self._bus)
        if reading.name != "baro":
            return
        self._heard_s = reading.t_s
        self._recent.append(said["raw_pressure"])
        pressure = said["static_pressure"]
        if pressure is None or not self.limit["least_pa"] < pressure < self.limit["most_pa"]:
            self._since_s = None
            what = "no pressure" if pressure is None else f"{pressure / 100.0:.0f} hPa"
            self.fail_check(f"says {what}, which cannot be: the sensor, or its memory is blank")
        elif len(self._recent) == self._recent.maxlen and len(set(self._recent)) == 1:
            self._since_s = None
            self.fail_check("stale: its reading repeats to the last digit")
        elif not self._bus:
            self._fine(reading.t_s, pressure)

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return self.reason or "no pressure came"

    def _fine(self, t_s: float, pressure_pa: float) -> None:
        if self._since_s is None:
            self._since_s = t_s
        self.values = {"static_pa": pressure_pa}
        if t_s - self._since_s >= self.limit["hold_s"]:
            self.pass_check()
        elif self.state != "seen":
            self.keep_waiting("fresh, watched for a moment")
