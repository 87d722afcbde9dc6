"""A pitot blown into through a hose that is pinched: pressure, its sign, and whether it holds."""

from __future__ import annotations

import math

from host.preflight.check import AskedCheck
from host.preflight.pressures import impact_pa
from host.preflight.sample import Sample

PITOTS = {"a": "left pitot", "b": "right pitot"}
_STEP = "a soft hose over its nose: blow gently, pinch the hose for 3 s, let go"


class PitotCheck(AskedCheck):
    """One pitot.

    Parameters
    ----------
    side : str
        ``a`` left, ``b`` right.
    other : str
        The other side, empty if there is none.
    """

    limits_of = "pitots"

    def __init__(self, side: str, other: str) -> None:
        super().__init__(f"dp_{side}", PITOTS[side], _STEP)
        self._side, self._other = side, other

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._rest: list[float] = []
        self._span = (math.inf, -math.inf)
        self._peak = self._other_peak = 0.0
        self._rose_s = self._high_s = math.nan
        self._longest_s = 0.0

    def take(self, sample: Sample) -> None:
        """Follow the pressure, less what it read at rest."""
        pressure = impact_pa(sample, self._side)
        if self._other:
            other = impact_pa(sample, self._other)
            if math.isfinite(other):
                self._other_peak = max(self._other_peak, other)
        if not math.isfinite(pressure):
            return
        self._span = min(self._span[0], pressure), max(self._span[1], pressure)
        if len(self._rest) < 5:
            self._rest.append(pressure)
            return
        self._check_rise(sample.t_s, pressure - sum(self._rest) / len(self._rest))

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        least, most = self._span
        if least > most:
            return "no valid value: its voltage is at an end of its range; open or shorted?"
        if self._other_peak > self.limit["blow_pa"] > self._peak:
            return (
                f"the {PITOTS[self._other]} rose in its place: plugs or hoses of the pair swapped"
            )
        if least == most:
            return f"reads {most:.0f} Pa and does not change by a count: dead or blocked"
        if self._longest_s:
            return f"held for {self._longest_s:.1f} s only: pinch the hose, or the tube leaks"
        return f"rose by {most - least:.0f} Pa at most: blocked, leaking, or not blown into"

    def _check_rise(self, t_s: float, pressure: float) -> None:
        blow = self.limit["blow_pa"]
        if pressure < -blow:
            self.fail_check("the pressure fell: the two hoses at its sensor are swapped")
            return
        if pressure > self.limit["blow_most_pa"]:
            self.fail_check(
                f"{pressure:.0f} Pa is the end of its range: blow gently, then do it again"
            )
            return
        if math.isnan(self._rose_s):
            if pressure > blow:
                self._rose_s, self._peak = t_s, pressure
            elif self._other_peak > 2.0 * blow and pressure < 0.2 * blow:
                self.fail_check(f"the {PITOTS[self._other]} rose in its place: swapped pair")
            return
        self._peak = max(self._peak, pressure)
        if pressure >= 0.8 * self._peak:
            self._high_s = t_s
        elif pressure <= 0.4 * self._peak and math.isfinite(self._high_s):
            self._let_go(t_s)

    def _let_go(self, t_s: float) -> None:
        """Judge a pressure that is gone."""
        fell_s, held_s = t_s - self._high_s, self._high_s - self._rose_s
        if self._other_peak > self.limit["other_share"] * self._peak:
            self.fail_check(f"the {PITOTS[self._other]} rose too: their hoses are joined")
        elif fell_s > self.limit["fall_s"]:
            self.fail_check(
                f"fell from {self._peak:.0f} Pa to a half in {fell_s:.1f} s while it was held: the"
                " tube or a joint leaks (or the hose was not pinched: do it again)"
            )
        elif held_s < self.limit["hold_s"]:
            self._longest_s = max(self._longest_s, held_s)
            self._rose_s = self._high_s = math.nan
            self.keep_waiting(f"held for {held_s:.1f} s: pinch the hose for 3 s")
        else:
            self.values = {"blown_pa": self._peak, "held_s": held_s}
            self.pass_check()
