"""The relay to the Mega and back to direct, by its sense line."""

from __future__ import annotations

import math

from host.preflight.check import AskedCheck
from host.preflight.pilot_settings import PilotSettings
from host.preflight.preflight_limits import limits
from host.preflight.sample import Sample, SlowReading


class RelayCheck(AskedCheck):
    """Switch at direct, at Mega, at direct again; the contact follows each time.

    Parameters
    ----------
    settings : PilotSettings
    """

    def __init__(self, settings: PilotSettings) -> None:
        super().__init__(
            "relay",
            "relay and sense line",
            "switch at direct, then to Mega for 2 s, then to direct",
        )
        self._settings = settings
        self._drive = ""

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._drive = ""
        self._at = ""
        self._since_s = math.nan
        self._phase = 0  # 0 at rest, 1 at Mega, 2 back

    def take_reading(self, reading: SlowReading) -> None:
        """Take the frames that say who drives the servos and whether the relay follows."""
        if reading.name == "system":
            self._drive = reading.said["drive"]
        elif reading.name == "event" and reading.said["code"] == "relay lost":
            self._lost()

    def take(self, sample: Sample) -> None:
        """Compare switch and contact."""
        width_us = sample["rc_switch_us"]
        at = self._position(width_us)
        if at != self._at:
            self._at, self._since_s = at, sample.t_s
        held_s = sample.t_s - self._since_s
        if self._phase == 0:
            self._rest(sample, held_s)
        elif self._phase == 1:
            self._engage(sample, held_s)
        else:
            self._release(sample, held_s)

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        if self._at == "none":
            return "no pulses on the switch channel"
        if self._phase == 0 and self._at == "between":
            return "the switch stands between direct and Mega (firmware/settings.toml)"
        place = {"direct": "direct", "mega": "Mega", "failsafe": "fail-safe"}.get(self._at, "rest")
        return f"the switch stays at {place}: its channel, or swapped with another"

    def _position(self, width_us: float) -> str:
        if math.isnan(width_us):
            return "none"
        if width_us < limits("failsafe")["switch_us"]:
            return "failsafe"
        if width_us <= self._settings.direct_max_us:
            return "direct"
        return "mega" if width_us >= self._settings.mega_min_us else "between"

    def _rest(self, sample: Sample, held_s: float) -> None:
        if self._at != "direct" or held_s < self.limit["rest_s"]:
            return
        if sample.mega_drives and held_s > self.limit["follow_s"]:
            self.fail_check(
                "stuck at Mega: the sense line says engaged with the switch at direct; a welded"
                " contact, Q1 shorted, or pin 9 at ground"
            )
        elif not sample.mega_drives:
            self._phase = 1

    def _engage(self, sample: Sample, held_s: float) -> None:
        if self._at != "mega":
            return
        if sample.mega_drives:
            if held_s >= self.limit["rest_s"]:
                self._phase = 2
        elif held_s > self.limit["follow_s"]:
            self._lost()

    def _release(self, sample: Sample, held_s: float) -> None:
        if self._at == "mega" and not sample.mega_drives:
            self.fail_check(
                "the contact fell back while the switch stood at Mega: its coil, its supply"
            )
        elif self._at == "direct" and not sample.mega_drives and held_s >= self.limit["rest_s"]:
            self.pass_check()
        elif self._at == "direct" and held_s > self.limit["follow_s"]:
            self.fail_check(
                "stuck at Mega: the sense line says engaged behind the switch to direct"
            )

    def _lost(self) -> None:
        if self.state == "waiting":
            drive = f" (the logger says: {self._drive})" if self._drive else ""
            self.fail_check(
                "stuck at direct: the sense line did not say engaged with the switch at Mega"
                f"{drive}; the relay does not pull in, or the sense line (pin 9) is broken"
            )
