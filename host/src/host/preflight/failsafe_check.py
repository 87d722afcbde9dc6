"""The transmitter switched off with the throttle up: the motor must stop by itself."""

from __future__ import annotations

import math

from host.preflight.check import AskedCheck
from host.preflight.logger_checks import RECEIVER
from host.preflight.pilot_settings import PilotSettings
from host.preflight.sample import Sample


class FailsafeCheck(AskedCheck):
    """Throttle to a quarter, transmitter off, on again.

    Parameters
    ----------
    settings : PilotSettings
    """

    limits_of = "failsafe"

    def __init__(self, settings: PilotSettings) -> None:
        super().__init__(
            "failsafe",
            "throttle fail-safe",
            "PROPELLER OFF: throttle to a quarter, transmitter off for 3 s, stick back, on again",
        )
        self._settings = settings

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._raised_us = math.nan
        self._ever_raised = False
        self._lost_s = self._back_s = math.nan
        self._judged = False
        self._last: tuple[float, ...] = ()
        self._changed_s = math.nan
        self._held_s = 0.0

    def take(self, sample: Sample) -> None:
        """Look for the loss, the throttle in it, and the return."""
        widths = tuple(sample[f"rc_{one}_us"] for one in RECEIVER)
        if widths != self._last or math.isnan(self._changed_s):
            self._last, self._changed_s = widths, sample.t_s
        throttle, switch = widths[3], widths[4]
        missing = sum(map(math.isnan, widths))
        lost = missing >= 3 or switch < self.limit["switch_us"]
        if math.isnan(self._lost_s):
            self._before(sample.t_s, throttle, lost)
        elif not self._judged:
            self._off(sample.t_s - self._lost_s, throttle, lost)
        else:
            self._on(sample.t_s, lost or missing > 0)

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        if self._judged:
            return "the transmitter did not come back"
        if not self._ever_raised:
            return "the throttle was not raised"
        if self._held_s > self.limit["held_s"]:
            return (
                f"all channels stood to the last digit for {self._held_s:.0f} s, throttle up: the"
                " receiver holds the last pulses; set its fail-safe (throttle idle, switch"
                f" below {self.limit['switch_us']:.0f} us)"
            )
        return (
            "no loss of the receiver was seen: if the transmitter was off, set the receiver's"
            f" fail-safe of the switch channel below {self.limit['switch_us']:.0f} us"
        )

    def _before(self, t_s: float, throttle: float, lost: bool) -> None:
        if not lost:
            if throttle > self._settings.idle_max_us + self.limit["raised_us"]:
                self._raised_us = throttle
                self._ever_raised = True
                self._held_s = max(self._held_s, t_s - self._changed_s)
            elif throttle <= self._settings.idle_max_us and self._held_s < self.limit["held_s"]:
                self._raised_us = math.nan
            return
        if math.isnan(self._raised_us):
            self.keep_waiting(
                "the transmitter went off with the throttle at idle: raise it to a quarter"
            )
            return
        self._lost_s = t_s

    def _off(self, since_s: float, throttle: float, lost: bool) -> None:
        if not lost:
            self._lost_s = math.nan  # a drop-out, or too short
            self.keep_waiting("off for a moment only: leave the transmitter off for 3 s")
            return
        if since_s < self.limit["settle_s"]:
            return
        self._judged = True
        self.values = {"throttle_before_us": self._raised_us}
        if math.isfinite(throttle):
            self.values["throttle_lost_us"] = throttle
        if throttle > self._settings.idle_max_us:
            self.fail_check(
                f"the throttle stays at {throttle:.0f} us without the transmitter, idle is"
                f" {self._settings.idle_max_us:.0f} at most: the fail-safe keeps it; do not fly"
            )

    def _on(self, t_s: float, lost: bool) -> None:
        if lost:
            self._back_s = math.nan
        elif math.isnan(self._back_s):
            self._back_s = t_s
        elif t_s - self._back_s >= self.limit["back_s"] and self.state == "waiting":
            self.pass_check()
