"""Home as the aircraft sees it: how far, where, and when it leaves the circle it may fly in."""

from __future__ import annotations

import math
from typing import Any

from host.constants import DEG_PER_RAD

WARNED_S = 8.0  # before the limit: a turn takes 5 s, a word to the pilot 3 s


def home_view(
    place_m: tuple[float, float], velocity_mps: tuple[float, float], limit_m: float
) -> dict[str, Any]:
    """Return what a page and a voice say of home.

    Parameters
    ----------
    place_m, velocity_mps : (float, float)
        East and north of home; over ground.
    limit_m : float
        Largest distance from home.

    Returns
    -------
    dict
        ``distance_m``, ``bearing_deg`` (to home, 0 to 360), ``limit_m``, ``limit_in_s`` (None where
        the limit is not near) and ``warning`` (empty without).
    """
    distance = math.hypot(*place_m)
    bearing = math.atan2(-place_m[0], -place_m[1]) * DEG_PER_RAD % 360.0
    in_s = _leaves_in_s(place_m, velocity_mps, limit_m)
    warning = ""
    if distance > limit_m:
        warning = f"{distance:.0f} m from home, outside {limit_m:.0f} m: turn home"
    elif in_s is not None:
        warning = f"{limit_m:.0f} m from home in {in_s:.0f} s: turn"
    return {
        "distance_m": round(distance, 1),
        "bearing_deg": round(bearing, 1),
        "limit_m": limit_m,
        "limit_in_s": in_s,
        "warning": warning,
    }


def _leaves_in_s(
    place_m: tuple[float, float], velocity_mps: tuple[float, float], limit_m: float
) -> float | None:
    """Return the time to the circle on a straight way, None beyond `WARNED_S` or outside."""
    (x, y), (u, v) = place_m, velocity_mps
    speed2, inward, room = u * u + v * v, x * u + y * v, limit_m**2 - x * x - y * y
    if room < 0.0 or not speed2 > 0.0:
        return None
    in_s = (math.sqrt(inward * inward + speed2 * room) - inward) / speed2
    return round(in_s, 1) if in_s < WARNED_S else None
