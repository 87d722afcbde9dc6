"""Time that an aircraft was in the air, from a log of an autopilot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray
from host.readers.named_channels import Channels
from host.readers.signals import Signal

FLYING_MPS = 6.0  # no fixed wing stays up slower; a pitot at rest reads less
LEAST_S = 3.0  # of flight: a gust on the pitot is shorter


@dataclass(frozen=True, slots=True)
class Airborne:
    """Time in the air (s), the highest speed (m/s) with its source, and both in words."""

    time_s: float
    fastest_mps: float
    by: str


def airborne(found: Channels, not_flying: Sequence[Signal] = ()) -> Airborne:
    """Return how long an aircraft flew on its wing.

    Parameters
    ----------
    found : Channels
    not_flying : sequence of Signal
        Above 0.5 where the autopilot itself says that it stands, or hovers.
    """
    speeds = _speeds(found)
    if not speeds:
        return Airborne(0.0, float("nan"), "")
    best = Airborne(0.0, 0.0, next(iter(speeds)))
    for by, (t_s, speed) in speeds.items():
        # A median over half a second: one wrong value is no flight.
        half = max(1, round(0.25 / max(float(np.median(np.diff(t_s))), 1e-3)))
        smooth = _median(speed, 2 * half + 1)
        flying = smooth > FLYING_MPS
        for other in not_flying:
            at = np.clip(np.searchsorted(other.t_s, t_s, side="right") - 1, 0, None)
            flying &= ~(other.values[at] > 0.5)
        time_s = _time_s(t_s, flying)
        one = Airborne(time_s if time_s >= LEAST_S else 0.0, float(np.max(smooth)), by)
        best = max(best, one, key=lambda a: (a.time_s, a.fastest_mps))
    return best


def _speeds(found: Channels) -> dict[str, tuple[Array, Array]]:
    known: dict[str, tuple[Array, Array]] = {}
    air = found.signals.get("airspeed_mps")
    if air is not None:
        known["airspeed"] = _finite(air.t_s, air.values)
    north, east = (found.signals.get(f"v_{k}_mps") for k in ("north", "east"))
    if north is not None and east is not None and len(north.t_s) == len(east.t_s):
        known["ground speed"] = _finite(north.t_s, np.hypot(north.values, east.values))
    return {by: pair for by, pair in known.items() if len(pair[0]) > 3}


def _finite(t_s: Array, values: Array) -> tuple[Array, Array]:
    seen = np.isfinite(values)
    return t_s[seen], values[seen]


def _median(values: Array, width: int) -> Array:
    width = min(width, len(values) - (len(values) + 1) % 2)
    padded = np.pad(values, width // 2, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, width)
    return np.asarray(np.median(windows, axis=1))


def _time_s(t_s: Array, flying: BoolArray) -> float:
    steps = np.diff(t_s)
    usual = 5.0 * float(np.median(steps)) if len(steps) else 0.0
    return float(np.sum(np.minimum(steps, usual)[flying[:-1] & flying[1:]]))
