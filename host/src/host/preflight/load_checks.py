"""Checks over some seconds of use: supply under servo load, radio at range."""

from __future__ import annotations

import math

from host.preflight.check import AskedCheck
from host.preflight.sample import Sample, SlowReading
from host.preflight.window import Window, scatter

_STICKS = ("elevator", "aileron", "rudder")


class SupplyCheck(AskedCheck):
    """Both supplies while every stick is stirred."""

    def __init__(self) -> None:
        super().__init__("supply", "supply under servo load", "stir all sticks at once for 8 s")

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._window = Window(2.0)
        self._stirred_s = 0.0
        self._last_s = math.nan
        self._rest_v = math.nan
        self._rail: list[float] = []
        self._supply: list[float] = []
        self._stirring = False

    def take(self, sample: Sample) -> None:
        """See whether sticks are stirred."""
        self._window.add(sample.t_s, [sample[f"rc_{one}_us"] for one in _STICKS])
        step_s = sample.t_s - self._last_s if math.isfinite(self._last_s) else 0.0
        self._last_s = sample.t_s
        self._stirring = self._window.full and all(
            scatter(column) > self.limit["stir_us"] for column in self._window.columns()
        )
        if self._stirring:
            self._stirred_s += min(step_s, 0.5)
        if self._stirred_s >= self.limit["stir_s"] and len(self._rail) > 2:
            self._judge()

    def take_reading(self, reading: SlowReading) -> None:
        """Take both voltages, said once a second."""
        if reading.name == "event" and reading.said["code"] == "rail low":
            self.fail_check(f"the servo rail fell to {reading.said['arg'] / 1000.0:.1f} V")
        if reading.name != "system":
            return
        rail_v, supply_v = reading.said["rail_v"], reading.said["supply_v"]
        if rail_v is None or supply_v is None:
            self.keep_waiting("no voltage of the servo rail: its divider on A15, receiver powered?")
        elif not self._stirring:
            if math.isnan(self._rest_v):
                self._rest_v = rail_v
        else:
            self._rail.append(rail_v)
            self._supply.append(supply_v)

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return self.reason or f"sticks were stirred for {self._stirred_s:.0f} s only, all at once"

    def _judge(self) -> None:
        rail_v, supply_v = min(self._rail), min(self._supply)
        rest_v = rail_v if math.isnan(self._rest_v) else self._rest_v
        self.values = {"rail_rest_v": rest_v, "rail_least_v": rail_v, "supply_least_v": supply_v}
        if rail_v < self.limit["rail_v"]:
            self.fail_check(
                f"the servo rail falls from {rest_v:.2f} to {rail_v:.2f} V, {self.limit['rail_v']}"
                " at least: charge the pack, a stiffer regulator, or a servo that binds"
            )
        elif rest_v - rail_v > self.limit["sag_v"]:
            self.fail_check(
                f"the servo rail sags by {rest_v - rail_v:.2f} V: a servo that binds, thin leads"
            )
        elif supply_v < self.limit["supply_v"]:
            self.fail_check(
                f"the logger's supply falls to {supply_v:.2f} V, {self.limit['supply_v']} at least:"
                " its regulator, or host calibrate supply"
            )
        else:
            self.pass_check()


class RadioCheck(AskedCheck):
    """Envelopes lost while somebody walks away with the radio.

    Parameters
    ----------
    by_wire : bool
        The source is the USB line: nothing can be said of the radio.
    """

    def __init__(self, *, by_wire: bool) -> None:
        super().__init__(
            "radio", "radio at range", "walk 100 paces away, turn round once: half a minute"
        )
        self._by_wire = by_wire

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._begin_s = math.nan
        self._rows = self._lost = 0
        if self._by_wire:
            self.fail_check("not looked at: this is a USB line; run it on the radio's port")

    def take(self, sample: Sample) -> None:
        """Count a row."""
        if math.isnan(self._begin_s):
            self._begin_s = sample.t_s
        self._rows += 1
        share = self._share()
        since_s = sample.t_s - self._begin_s
        if since_s < self.limit["window_s"]:
            self.reason = f"{since_s:.0f} s, lost {share:.1%}"
            return
        self.values = {"lost_share": share, "rows": float(self._rows)}
        if share > self.limit["lost_share"]:
            self.fail_check(
                f"{share:.0%} of its rows lost, {self.limit['lost_share']:.0%} at most: antennas,"
                " their place in the aircraft, the channel"
            )
        else:
            self.pass_check()

    def lost(self, rows: int) -> None:
        """Take how many rows did not arrive."""
        self._lost += rows

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return f"{self.reason}; then nothing came" if self.reason else "nothing came"

    def _share(self) -> float:
        return self._lost / (self._rows + self._lost) if self._rows + self._lost else 0.0
