"""Full stick each way: the surface's direction and travel against the aircraft file."""

from __future__ import annotations

import math

from host.preflight.check import AskedCheck
from host.preflight.sample import Sample

# Surface -> what it measures (column, sign in the surface's positive sense), what the pilot does.
SURFACES = {
    "elevator": (
        (("elevator_pot_deg", 1.0),),
        "stick fully forward (elevator down), then fully back, then let go",
        "down",
    ),
    "aileron": (
        (("aileron_left_deg", 1.0), ("aileron_right_deg", -1.0)),
        "stick fully right (right aileron up), then fully left, then let go",
        "left one down",
    ),
    "rudder": (
        (("rudder_pot_deg", 1.0),),
        "stick fully left (rudder to the left), then fully right, then let go",
        "to the left",
    ),
}
POT_NAMES = {
    "elevator_pot_deg": "elevator's pot",
    "aileron_left_deg": "left aileron's pot",
    "aileron_right_deg": "right aileron's pot",
    "rudder_pot_deg": "rudder's pot",
}


class Throw:
    """Travel of one column from its rest: which side came first, least and largest value."""

    def __init__(self, moved: float) -> None:
        self.moved = moved
        self.rest = self.least = self.most = math.nan
        self.first = 0
        self.at = math.nan

    def add(self, value: float) -> None:
        """Take a value; NaN is none."""
        if not math.isfinite(value):
            return
        if math.isnan(self.rest):
            self.rest = self.least = self.most = value
        self.at = value
        self.least, self.most = min(self.least, value), max(self.most, value)
        if not self.first and abs(value - self.rest) > self.moved:
            self.first = 1 if value > self.rest else -1

    @property
    def up(self) -> float:
        """How far above its rest."""
        return self.most - self.rest

    @property
    def down(self) -> float:
        """How far below its rest."""
        return self.rest - self.least

    @property
    def both(self) -> bool:
        """Whether it went both ways."""
        return self.up > self.moved and self.down > self.moved

    @property
    def back(self) -> bool:
        """Whether it is near its rest again."""
        return abs(self.at - self.rest) < self.moved


class SurfaceCheck(AskedCheck):
    """One stick and what it moves.

    Parameters
    ----------
    surface : str
        One of `SURFACES`.
    limit_deg : float or None
        Travel each way, of the aircraft file; None where it has none.
    pulse_slope : float
        Surface angle per microsecond, of the calibration; its sign says which way the channel goes.
    pots : bool
        False where no pot measures it: the channel alone is looked at.
    """

    limits_of = "surfaces"

    def __init__(
        self, surface: str, limit_deg: float | None, pulse_slope: float, *, pots: bool
    ) -> None:
        columns, step, self._way = SURFACES[surface]
        super().__init__(surface, f"{surface}: full stick", step)
        self._surface, self._limit_deg, self._slope = surface, limit_deg, pulse_slope
        self._columns = dict(columns) if pots else {}

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        moved = self.limit["moved_share"] * (self._limit_deg or 20.0)
        self._pots = {name: Throw(moved) for name in POT_NAMES}
        self._sticks = {name: Throw(self.limit["moved_us"]) for name in SURFACES}

    def take(self, sample: Sample) -> None:
        """Follow every stick and every pot."""
        for name, throw in self._pots.items():
            throw.add(sample[name])
        for name, throw in self._sticks.items():
            throw.add(sample[f"rc_{name}_us"])
        own = self._sticks[self._surface]
        if own.both and own.back and all(self._pots[name].back for name in self._own_pots()):
            self._judge(own)
        elif not own.first and math.isfinite(own.rest) and self._elsewhere():
            self.fail_check(
                f"the {self._elsewhere()} channel moved in its place: channels swapped at the"
                " receiver, or input_... in firmware/settings.toml"
            )

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        own = self._sticks[self._surface]
        if math.isnan(own.rest):
            return f"no pulses on {self._surface}: its lead, or the transmitter"
        if own.both:
            return self._pot_fault() or "the surface is not back at its rest"
        if own.first:
            return (
                f"its channel moved {own.up:.0f} us up and {own.down:.0f} us down: both ways wanted"
            )
        return f"its channel stands at {own.at:.0f} us"

    def _own_pots(self) -> list[str]:
        """Return the columns of pots that have a value."""
        return [name for name in self._columns if math.isfinite(self._pots[name].at)]

    def _elsewhere(self) -> str:
        """Return the stick that went both ways in place of this one, empty if none did."""
        others = (name for name in self._sticks if name != self._surface)
        return next((n for n in others if self._sticks[n].both and self._sticks[n].back), "")

    def _judge(self, own: Throw) -> None:
        wrong_channel = own.first * self._slope < 0.0
        for name in self._columns:
            throw = self._pots[name]
            self.values[f"{name.removesuffix('_deg')}_up_deg"] = throw.up
            self.values[f"{name.removesuffix('_deg')}_down_deg"] = throw.down
        reason = self._pot_fault()
        if reason:
            self.fail_check(reason)
        elif wrong_channel and all(
            self._pots[name].first == -sign for name, sign in self._columns.items()
        ):
            self.fail_check(
                f"wrong direction: with this stick the surface goes {self._way} last, not first;"
                " reverse the channel in the transmitter (or the stick was moved the other way)"
            )
        elif wrong_channel:
            self.fail_check("its channel goes the other way than its calibration says ([pulse])")
        else:
            self._travel(own)

    def _pot_fault(self) -> str:
        """Return which pot is dead, swapped with another, or against its stick; empty if none."""
        own = self._sticks[self._surface]
        sense = own.first if self._slope > 0.0 else -own.first
        for name, sign in self._columns.items():
            throw = self._pots[name]
            if math.isnan(throw.at):
                return f"the {POT_NAMES[name]} has no valid value: open or shorted"
            if not throw.first:
                moved = [
                    POT_NAMES[one]
                    for one, other in self._pots.items()
                    if one not in self._columns and other.first
                ]
                if moved:
                    return f"the {moved[0]} moved in place of the {POT_NAMES[name]}: plugs swapped"
                if throw.least == throw.most:
                    return f"the {POT_NAMES[name]} does not change by a count: dead"
                return f"the stick moved, the surface (or the {POT_NAMES[name]}) hardly did"
            if throw.first != sign * sense:
                plugs = ", left and right plugs swapped" if len(self._columns) > 1 else ""
                return (
                    f"wrong direction by the {POT_NAMES[name]}: the surface goes against its stick;"
                    f" servo reversed, linkage{plugs}, or the pot's sign"
                )
        return ""

    def _travel(self, own: Throw) -> None:
        limit_deg = self._limit_deg
        if min(own.up, own.down) < self.limit["full_us"]:
            self.fail_check(
                f"its channel moved {own.up:.0f} us up and {own.down:.0f} us down only: stick not"
                " full, dual rate, or limits in the transmitter"
            )
            return
        for name in self._columns if limit_deg else ():
            throw = self._pots[name]
            for way in (throw.up, throw.down):
                if limit_deg and not (
                    self.limit["least_share"] <= way / limit_deg <= self.limit["most_share"]
                ):
                    self.fail_check(
                        f"{POT_NAMES[name]}: {throw.up:.0f} deg one way, {throw.down:.0f} the"
                        f" other, the aircraft file says {limit_deg:.0f}: travel, linkage, or file"
                    )
                    return
        self.pass_check()
