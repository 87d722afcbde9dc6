"""Turns between the test points of a card, so that the flight stays near its pilot."""

from __future__ import annotations

import math
from dataclasses import replace

from host.constants import GRAVITY_MPS2
from host.planning.flight_envelope import Envelope
from host.twin.flight.pilot import TURN_RAD
from host.twin.testcard.cards import Card, Segment, length_s, turns_home

# Both were chosen on seeds 0 to 7 of the demonstration.
LEG_SHARE = 0.9  # of the card's limit: a leg from one side of home to the other
ROLL_S = 3.6  # to roll in and out, and past the half circle


def turn_s(airspeed_mps: float) -> float:
    """Return the time of half a circle."""
    around_s = math.pi * airspeed_mps / (GRAVITY_MPS2 * math.tan(TURN_RAD))
    return round(around_s + ROLL_S)


def with_turns(card: Card) -> Card:
    """Return the card with a turn towards home before each point that makes a leg too long.

    Parameters
    ----------
    card : Card
        With its airspeed, starting at home.

    Returns
    -------
    Card
        The same points in the same order, on legs of at most `LEG_SHARE` of the usual limit where
        a single point is not longer.
    """
    speed_mps = card.flight.airspeed_mps
    most_m = LEG_SHARE * Envelope().distance_m
    turn = Segment("turn", duration_s=turn_s(speed_mps))
    segments: list[Segment] = []
    leg_m = 0.0
    for s in card.segments:
        more_m = speed_mps * length_s(card, s)
        if leg_m > 0.0 and leg_m + more_m > most_m:
            segments.append(turn)
            leg_m = 0.0
        segments.append(s)
        leg_m += more_m
    return replace(card, segments=tuple(segments))


def turns_before(card: Card) -> list[int]:
    """Return the numbers, from 1, of the test points of a card that a turn home comes before."""
    found: list[int] = []
    count, turned = 0, False
    for s in card.segments:
        if s.kind not in ("trim", "turn"):
            count += 1
            found += [count] if turned else []
        turned = turns_home(s) or (turned and s.kind == "trim")
    return found
