"""Latitude and longitude -> metres east and north of the flight's first fix."""

from __future__ import annotations

from typing import Any

import numpy as np

from host.constants import METRES_PER_DEG
from host.report.shown_flight import ShownFlight

# Mean of the metres of a degree of latitude on WGS 84: 0.5 % at worst, over 1 km 5 m.
_MOST_POINTS = 3000


def ground_track(flight: ShownFlight) -> dict[str, Any] | None:
    """Return ``t_s``, ``east_m`` and ``north_m`` as lists, None without GPS.

    At most 3000 points; None in the lists where no fix was.
    """
    if "latitude_deg" not in flight.columns or "longitude_deg" not in flight.columns:
        return None
    latitude, longitude = flight.columns["latitude_deg"], flight.columns["longitude_deg"]
    every = max(1, -(-len(latitude) // _MOST_POINTS))
    t_s, latitude, longitude = flight.t_s[::every], latitude[::every], longitude[::every]
    known = np.isfinite(latitude) & np.isfinite(longitude)
    if known.sum() < 2:
        return None
    first = int(np.argmax(known))
    north = (latitude - latitude[first]) * METRES_PER_DEG
    east = (longitude - longitude[first]) * METRES_PER_DEG * np.cos(np.deg2rad(latitude[first]))
    return {
        "t_s": [round(float(one), 3) for one in t_s],
        "east_m": _rounded(east),
        "north_m": _rounded(north),
    }


def _rounded(values: Any) -> list[float | None]:
    return [round(float(one), 1) if np.isfinite(one) else None for one in values]
