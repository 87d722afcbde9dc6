"""What a logger may fly by itself, and how far from home: limits of a card."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Envelope:
    """What ends an input, besides sticks, switch and the recorder's health.

    A value on a limit is inside. Defaults are those of a trainer's first flights.
    """

    alpha_deg: float = 8.0  # either way from trim
    beta_deg: float = 15.0
    bank_deg: float = 50.0
    pitch_deg: float = 30.0
    rates_degps: float = 150.0
    load_least: float = 0.0
    load_most: float = 2.5
    height_least_m: float = 40.0
    height_most_m: float = 200.0
    distance_m: int = 300
    still_ms: int = 500
    stick_us: int = 40
    amplitude_share: float = 1.0  # a third on the first flights
    frequency_hz: float = 5.0
