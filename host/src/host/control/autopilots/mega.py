"""The logger's own hold of an attitude: angle error and rate to an angle of the surface, one axis.

Nothing is demanded but the attitude that a row began with, so there is no feed-forward, and no gain
follows the airspeed: a blocked pitot moves no surface. Gains count in angles of the surface; what
the servo makes of a pulse is the calibration's.

The loop runs at the IMU's rate. A packet starts 3 ms behind its sample and is through before the
next (firmware/boards/arduimu): the law acts on rates one period old. The attitude is made of rates
behind the gyro's low-pass, whose 4.8 ms make its angles another period older.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from host.arrays import Array
from host.control.autopilots import parameter_table
from host.control.autopilots.tabled import TabledAxis

FULL_RAD = 1.0  # of surface: the unit of the law's output
# The University of Minnesota flew 0.64 / 0.20 in roll and 0.90 / 0.30 in pitch (OpenFlight,
# heading_tracker.c).
INTEGRAL_S = 3.0


@dataclass(frozen=True, slots=True)
class MegaLoop:
    """One axis with gains; states are two late errors, a late rate and the integral."""

    gains: Mapping[str, float]
    period_s: float
    states: int = field(default=4, init=False)

    def step(self, state: Array, angle_error: Array, rate: Array) -> tuple[Array, Array]:
        """Return the new state and the surface's angle, rad."""
        waiting, error, late_rate = state[..., 0], state[..., 1], state[..., 2]
        integral = state[..., 3] + self.gains["I"] * error * self.period_s
        out = self.gains["P"] * error + integral - self.gains["D"] * late_rate
        return np.stack([angle_error, waiting, rate, integral], axis=-1), out


@dataclass(frozen=True)
class Mega(TabledAxis):
    """One axis of the logger's hold; a card's rate limit is its own."""

    autopilot: ClassVar[str] = "mega"
    searched: ClassVar[tuple[str, ...]] = ("P", "D")
    fastest: ClassVar[str] = "attitude"

    def completed(self, chosen: Mapping[str, float], feed_forward: float) -> dict[str, float]:
        """Return every gain: the integral restores an error within three seconds."""
        return {**chosen, "I": self.settings["I"].rounded(chosen["P"] / INTEGRAL_S)}

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> MegaLoop:
        """Return the axis with gains; no airspeed changes them."""
        return MegaLoop(dict(gains), 1.0 / self.fixed["loop_hz"])


def structure(axis: str, logged: Mapping[str, float], trim_mps: float) -> Mega:
    """Return an axis of the hold; the logger's rate and filter are the firmware's.

    Parameters
    ----------
    axis : str
        ``roll`` or ``pitch``.
    logged : mapping of str to float
        Nothing of it is asked.
    trim_mps : float
        Airspeed of the model; no gain follows it.
    """
    return Mega(axis, parameter_table.fixed("mega", {}, logged))
