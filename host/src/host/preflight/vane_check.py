"""Check of a vane lifted to both stops: direction, travel, middle, no other vane moving."""

from __future__ import annotations

import math

from host.preflight.check import AskedCheck
from host.preflight.sample import Sample

VANES = {
    "alpha_a": ("left alpha vane", "tail up to the stop, then down, then let go"),
    "alpha_b": ("right alpha vane", "tail up to the stop, then down, then let go"),
    "beta_a": ("left beta vane", "tail to the left to the stop, then right, then let go"),
    "beta_b": ("right beta vane", "tail to the left to the stop, then right, then let go"),
}


class VaneCheck(AskedCheck):
    """One vane.

    Parameters
    ----------
    channel : str
        One of `VANES`.
    others : tuple of str
        Vanes that must stand still meanwhile.
    """

    limits_of = "vanes"

    def __init__(self, channel: str, others: tuple[str, ...]) -> None:
        title, step = VANES[channel]
        super().__init__(channel, title, step)
        self._channel, self._others = channel, others

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._least = self._most = math.nan
        self._first = 0  # which way it went first
        self._other: dict[str, tuple[float, float]] = {}
        self._valid = False

    def take(self, sample: Sample) -> None:
        """Follow the vane."""
        for name in self._others:
            self._follow_other(name, sample[f"{name}_deg"])
        angle = sample[f"{self._channel}_deg"]
        if math.isfinite(angle):
            self._valid = True
            self._least, self._most = _wider((self._least, self._most), angle)
            self._follow(angle)
        if self.state == "waiting":
            self._swapped()

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        if not self._valid:
            return "no valid value: its voltage is at an end of its range; open or shorted?"
        if self._least == self._most:
            return f"stands at {self._most:.1f} deg and does not change by a count: dead"
        if self._most - self._least < 5.0:
            return f"stands at {self._most:.1f} deg: stuck, slipped on its axle, or not lifted"
        return (
            f"moved between {self._least:+.0f} and {self._most:+.0f} deg only: it sticks, or"
            f" was not taken to both stops at {self.limit['stop_deg']:.0f} deg"
        )

    def _follow(self, angle: float) -> None:
        seen, back = self.limit["seen_deg"], self.limit["back_deg"]
        if not self._first and abs(angle) > seen:
            self._first = 1 if angle > 0.0 else -1
        if self._first > 0 and self._least < -seen and angle > self._least + back:
            self._judge()
        elif self._first < 0 and self._most > seen and angle < self._most - back:
            self.fail_check(
                f"went to {self._least:+.0f} deg first: wrong direction, its sign in the"
                " calibration, or the vane on the other side of its axle"
            )

    def _judge(self) -> None:
        middle = 0.5 * (self._most + self._least)
        stop = 0.5 * (self._most - self._least)
        self.values = {"stop_up_deg": self._most, "stop_down_deg": self._least}
        if abs(middle) > self.limit["middle_deg"]:
            self.fail_check(
                f"the middle of its stops reads {middle:+.1f} deg: slipped on its axle since it was"
                f" calibrated ({self._least:+.0f} to {self._most:+.0f} deg)"
            )
        elif abs(stop - self.limit["stop_deg"]) > self.limit["stop_tolerance_deg"]:
            self.fail_check(
                f"travels {stop:.0f} deg to each stop, {self.limit['stop_deg']:.0f} expected: its"
                " slope in the calibration, or something in its way"
            )
        else:
            self.pass_check()

    def _follow_other(self, name: str, angle: float) -> None:
        if math.isfinite(angle):
            self._other[name] = _wider(self._other.get(name, (math.nan, math.nan)), angle)

    def _swapped(self) -> None:
        """Fail with the name of the vane that went to both stops in place of this one."""
        still = not self._valid or self._most - self._least < self.limit["back_deg"]
        for name, (least, most) in self._other.items():
            if still and least < -self.limit["seen_deg"] and most > self.limit["seen_deg"]:
                self.fail_check(f"the {VANES[name][0]} moved in its place: plugs swapped")


def _wider(span: tuple[float, float], value: float) -> tuple[float, float]:
    """Return a span that holds a value too; of NaN the value alone."""
    least, most = span
    return (value, value) if math.isnan(least) else (min(least, value), max(most, value))
