"""The pilot's part of a card whose inputs the logger flies.

The pilot shows the travel and gives the sign on the ground, climbs, stays near home, and moves the
switch (hw/test-inputs.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from host.constants import GRAVITY_MPS2
from host.twin.testcard.cards import Card, CardError, Segment, length_s, turns_home

GROUND_S = 17.0  # the logger makes sure of the ground; sticks stirred, enabling sign, idle
TILTS_S = 10.0  # tilted behind them, where the card holds axes
# At Mega for half a second, at armed for 0.3 s; both with room for the receiver's frames.
AT_MEGA_S, AT_ARMED_S = 0.9, 0.32
SWITCH_S = AT_MEGA_S + AT_ARMED_S
STEER_S, LEVEL_S = 2.0, 1.5  # before the switch moves: back on the leg, then wings level
PREPARE_S = STEER_S + LEVEL_S + SWITCH_S
# The logger asks for height above the field: 60 m at the 2.5 m/s of the pilot, then level.
CLIMB_M, CLIMB_S = 60.0, 32.0
BANK_DEG = 30.0
SETTLED_S = 3.0  # straight flight after a turn
REACH_SHARE = 0.75  # of the distance the logger allows: the turns' own width needs the rest


@dataclass(slots=True)
class _Legs:
    """Dead reckoning along the first heading, home at 0; half circles at the ends."""

    speed_mps: float
    wind_mps: float  # along the first heading
    reach_m: float
    along_m: float = 0.0
    way: float = 1.0
    segments: list[Segment] = field(default_factory=list)

    def room_s(self) -> float:
        """Return the time until the end of the leg."""
        return (self.reach_m - self.way * self.along_m) / self._leaving_mps()

    def fly(self, s: Segment, seconds: float) -> None:
        self.segments.append(s)
        self.along_m += self.way * self._leaving_mps() * seconds

    def trim(self, seconds: float) -> None:
        self.fly(Segment("trim", duration_s=seconds), seconds)

    def turn(self) -> None:
        around_s = math.pi * self.speed_mps / (GRAVITY_MPS2 * math.tan(math.radians(BANK_DEG)))
        around_s += 1.0  # a second of rolling at each end
        self.segments.append(Segment("turn", duration_s=around_s, bank_deg=BANK_DEG))
        self.along_m += self.wind_mps * around_s
        self.way = -self.way
        self.trim(SETTLED_S)

    def make_room(self, seconds: float) -> None:
        """Turn where the leg is too short: here if that is enough, else at its end."""
        if self.room_s() >= seconds:
            return
        here = replace(self, segments=[])
        here.turn()
        if here.room_s() < seconds:
            self.trim(max(self.room_s(), 0.0))
        self.turn()

    def _leaving_mps(self) -> float:
        return self.speed_mps + self.way * self.wind_mps


def flown_by_logger(
    card: Card, airspeed_mps: float, distance_m: float, *, holds: bool = False
) -> Card:
    """Return the card with a climb, time for the switch, and turns that keep near home.

    Parameters
    ----------
    card : Card
    airspeed_mps : float
        Wanted where the card does not say.
    distance_m : float
        Largest distance from home at which the logger starts an input; 0 for no limit.
    holds : bool
        It holds axes, so the pilot shows it their sense on the ground.

    Returns
    -------
    Card
        Trims of `PREPARE_S` before inputs; half circles where a leg would become too long.

    Raises
    ------
    CardError
        A single input already leads farther away than that.
    """
    speed = card.flight.airspeed_mps or airspeed_mps
    heading = math.radians(card.flight.heading_deg)
    air = card.air
    wind = air.wind_north_mps * math.cos(heading) + air.wind_east_mps * math.sin(heading)
    legs = _Legs(speed, wind, REACH_SHARE * distance_m if distance_m else math.inf)
    left_s = CLIMB_S
    while left_s > 0.0:
        leg_s = min(legs.room_s(), left_s)
        legs.trim(leg_s)
        legs.turn()
        left_s -= leg_s
    for s in card.segments:
        if turns_home(s):
            continue  # the legs have their own
        needed_s = length_s(card, s)
        if s.kind not in ("trim", "turn"):
            needed_s += PREPARE_S
        legs.make_room(needed_s)
        if legs.room_s() < needed_s:
            raise CardError(
                f"{card.name}: {s.kind} of {needed_s:.0f} s with what is flown around it, expected"
                f" at most {legs.room_s():.0f} s within {distance_m:.0f} m of home"
            )
        if s.kind not in ("trim", "turn"):
            legs.trim(PREPARE_S)
            needed_s -= PREPARE_S
        legs.fly(s, needed_s)
    climb_m = min(CLIMB_M, 0.9 * card.flight.height_m)
    ground_s = max(card.flight.ground_s, GROUND_S + (TILTS_S if holds else 0.0))
    flight = replace(card.flight, ground_s=ground_s, climb_m=climb_m)
    return replace(card, segments=tuple(legs.segments), flight=flight)
