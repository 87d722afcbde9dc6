"""What is told of a step: rise time, overshoot, settling, and how much the surface moves."""

from __future__ import annotations

import numpy as np
from host.arrays import Array

from studies.tuned_flights.closed_loop_flight import Demand, Flown

SETTLED_SHARE = 0.05  # of the step (Franklin, Powell & Emami-Naeini, Feedback Control, ch. 3)
END_S = 2.0
MOVING_SHARE = 0.1  # of the largest excursion of the surface


def step_figures(flown: Flown, demand: Demand) -> Array:
    """Return rise time (10 to 90 %, s), overshoot (%), settling (s), surface rate (rad/s rms).

    Not a number where the step never gets there.
    """
    axis = "roll" if demand.bank_rad else "pitch"
    size = demand.bank_rad or demand.pitch_rad
    behind = flown.t_s >= demand.at_s
    t = flown.t_s[behind] - demand.at_s
    share = (flown.angle_rad[axis][behind] - flown.angle_rad[axis][0]) / size
    rise = _first(t, share >= 0.9) - _first(t, share >= 0.1)
    outside = np.flatnonzero(np.abs(share - 1.0) > SETTLED_SHARE)
    settled = 0.0
    if len(outside):
        settled = float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else np.nan
    rate = np.diff(flown.surface_rad[axis]) / np.diff(flown.t_s)
    over = max(100.0 * float(np.max(share) - 1.0), 0.0)
    return np.array([rise, over, settled, float(np.sqrt(np.mean(rate**2)))])


def moving_at_the_end(flown: Flown) -> bool:
    """Return whether a surface still swings in calm air: a loop that is nearly unstable."""
    end = flown.t_s >= flown.t_s[-1] - END_S
    for surface in flown.surface_rad.values():
        left = surface[end] - np.polyval(
            np.polyfit(flown.t_s[end], surface[end], 2), flown.t_s[end]
        )
        if np.ptp(left) > MOVING_SHARE * np.ptp(surface):
            return True
    return False


def _first(t: Array, reached: Array) -> float:
    return float(t[np.argmax(reached)]) if reached.any() else np.nan
