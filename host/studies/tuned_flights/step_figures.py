"""Figures of a step: rise time, overshoot, settling, and how much the surface moves."""

from __future__ import annotations

import numpy as np
from host.arrays import Array

from studies.tuned_flights.closed_loop_flight import Demand, Flown

SETTLED_SHARE = 0.05  # of the step (Franklin, Powell & Emami-Naeini, Feedback Control, ch. 3)
END_S = 2.0
SLOW_END_S = 10.0  # of height and airspeed
MOVING_SHARE = 0.1  # of the largest excursion of the surface


def step_figures(flown: Flown, demand: Demand) -> Array:
    """Return rise time (10 to 90 %, s), overshoot (%), settling (s), surface rate (rad/s rms).

    Not a number where the step never gets there.
    """
    axis = "roll" if demand.bank_rad else "pitch"
    stepped, size = _stepped(flown, demand)
    behind = flown.t_s >= demand.at_s
    t = flown.t_s[behind] - demand.at_s
    share = (stepped[behind] - stepped[0]) / size
    rise = _first(t, share >= 0.9) - _first(t, share >= 0.1)
    outside = np.flatnonzero(np.abs(share - 1.0) > SETTLED_SHARE)
    settled = 0.0
    if len(outside):
        settled = float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else np.nan
    rate = np.diff(flown.surface_rad[axis]) / np.diff(flown.t_s)
    over = max(100.0 * float(np.max(share) - 1.0), 0.0)
    return np.array([rise, over, settled, float(np.sqrt(np.mean(rate**2)))])


def _stepped(flown: Flown, demand: Demand) -> tuple[Array, float]:
    """Return what a step was asked of, and its size."""
    if demand.height_m:
        return flown.height_m, demand.height_m
    if demand.airspeed_mps:
        return flown.airspeed_mps, demand.airspeed_mps
    axis = "roll" if demand.bank_rad else "pitch"
    return flown.angle_rad[axis], demand.bank_rad or demand.pitch_rad


def moving_at_the_end(flown: Flown, demand: Demand) -> bool:
    """Return whether something still swings in calm air: a loop that is nearly unstable.

    A surface; behind a step of height or airspeed these too, by a share of the step.
    """
    if demand.height_m or demand.airspeed_mps:
        stepped, size = _stepped(flown, demand)
        if np.ptp(stepped[flown.t_s >= flown.t_s[-1] - SLOW_END_S]) > MOVING_SHARE * abs(size):
            return True
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
