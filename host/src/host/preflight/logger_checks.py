"""Checks of the logger itself: settings, resets, receiver, card."""

from __future__ import annotations

import math
from collections import deque

from host.preflight.check import Check
from host.preflight.preflight_limits import limits
from host.preflight.sample import Sample, SlowReading

RECEIVER = ("aileron", "elevator", "rudder", "throttle", "switch")


class LoggerCheck(Check):
    """The logger sends settings that name this aircraft, and does not reset itself.

    Parameters
    ----------
    aircraft : str
        Name of the aircraft file.
    """

    latched = True

    def __init__(self, aircraft: str) -> None:
        super().__init__(
            "logger", "logger and settings", "nothing: its settings come by themselves"
        )
        self._aircraft = aircraft
        self._uptime_s = -1
        self._first_s: float | None = None
        self._broken = ""

    def take(self, sample: Sample) -> None:
        """Count the time without settings."""
        if self._first_s is None:
            self._first_s = sample.t_s
        late = sample.t_s - self._first_s > self.limit["settings_s"]
        if late and self.state == "waiting":
            self.fail_check("no settings heard: is its firmware ours, its telemetry set to frames?")

    def take_reading(self, reading: SlowReading) -> None:
        """Take settings, events, and the time since power-on."""
        said = reading.said
        if reading.name == "system":
            uptime_s = said["uptime_s"]
            if uptime_s is not None and uptime_s < self._uptime_s:
                self._broken = "it was reset during the preflight: look at its supply"
            self._uptime_s = self._uptime_s if uptime_s is None else uptime_s
        elif reading.name == "event" and said["code"] == "reset" and self._uptime_s >= 0:
            self._broken = "it was reset during the preflight: look at its supply"
        elif reading.name == "event" and said["code"] == "crash":
            self._broken = "its program crashed and began anew: do not fly, send the log"
        elif reading.name == "event" and said["code"] == "settings default":
            self._broken = "its stored settings are damaged or of another version: default ones act"
        elif reading.name == "status" and not self._broken:
            self.pass_check()  # over USB its settings are not said
        elif reading.name == "config" and said["aircraft"] != self._aircraft:
            self._broken = (
                f"it is set for {said['aircraft'] or 'no aircraft'}, the aircraft file is"
                f" {self._aircraft}: firmware/settings.toml"
            )
        elif reading.name == "config":
            self.values["rate_hz"] = float(said["rate_hz"])
            if not self._broken:
                self.pass_check()
        if self._broken:
            self.fail_check(self._broken)


class ReceiverCheck(Check):
    """All five channels come, without glitches."""

    latched = True

    def __init__(self) -> None:
        super().__init__("receiver", "receiver, five channels", "transmitter on, sticks at rest")
        self._since_s: float | None = None
        self._glitches: deque[tuple[float, int]] = deque(maxlen=4)
        self._odd = ""
        self._preset_us = limits("failsafe")["switch_us"]

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._odd = ""

    def take(self, sample: Sample) -> None:
        """Look for a channel without pulses."""
        if self._odd:
            return
        missing = [one for one in RECEIVER if math.isnan(sample[f"rc_{one}_us"])]
        if missing:
            self._since_s = None
            what = "any channel" if len(missing) == len(RECEIVER) else ", ".join(missing)
            hint = (
                "transmitter on, receiver powered?" if len(missing) > 1 else "its lead in A8-A12?"
            )
            self.keep_waiting(f"no pulses on {what}: {hint}")
            return
        if sample["rc_switch_us"] < self._preset_us:
            self._since_s = None
            self.keep_waiting("it sends its preset pulses: is the transmitter on?")
            return
        if self._since_s is None:
            self._since_s = sample.t_s
        rate = self._glitch_rate()
        if rate is None or sample.t_s - self._since_s < self.limit["hold_s"]:
            return
        self.values["glitches_per_s"] = rate
        if rate > self.limit["glitches_per_s"]:
            self.fail_check(f"{rate:.0f} wrong pulses a second: a loose lead, or noise near it")
        else:
            self.pass_check()

    def take_reading(self, reading: SlowReading) -> None:
        """Take the count of wrong pulses."""
        if reading.name == "system":
            self._glitches.append((reading.t_s, reading.said["rc_glitches"]))
        elif reading.name == "event" and reading.said["code"] in (
            "receiver storm",
            "receiver refused",
        ):
            word = "a storm of edges" if "storm" in reading.said["code"] else "pulses of no servo"
            self._odd = f"{word} on its lines: a loose lead, or noise near it"
            self.fail_check(self._odd)

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return self.reason or "no rows of receiver channels"

    def _glitch_rate(self) -> float | None:
        recent = self._glitches
        if len(recent) < 3 or recent[-1][0] <= recent[0][0]:
            return None
        return ((recent[-1][1] - recent[0][1]) % 65536) / (recent[-1][0] - recent[0][0])


class CardCheck(Check):
    """A file is ready on the card; if not, the status line over USB gives the reason."""

    def __init__(self) -> None:
        super().__init__("card", "card ready", "nothing: card in, it is looked at by itself")
        self._since_s: float | None = None
        self._status = ""

    def take_reading(self, reading: SlowReading) -> None:
        """Take the logger's frames about its card."""
        if reading.name == "status":
            self._status = reading.said["card"]
        elif reading.name == "event" and reading.said["code"] in ("card removed", "card error"):
            self._status = reading.said["code"].replace("card ", "")
        elif reading.name == "system":
            self._judge(reading)

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return self.reason or "the logger has not said: no frame `system` came"

    def _judge(self, reading: SlowReading) -> None:
        said = reading.said
        if "card" not in said["sensors"]:
            self._since_s = None
            why = (
                self._status
                or "missing, full, or not prepared yet; `host status` on USB says which"
            )
            self.fail_check(f"no file is ready on the card: {why}")
        elif said["card_errors"]:
            self.fail_check(f"{said['card_errors']} card errors since power-on: use another card")
        else:
            if self._since_s is None:
                self._since_s = reading.t_s
            if reading.t_s - self._since_s >= self.limit["hold_s"]:
                self.pass_check()
            elif self.state != "seen":
                self.keep_waiting("seen ready, watched for a moment")
