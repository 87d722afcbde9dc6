"""Where the aircraft is, from home, and the wind it flies in."""

from __future__ import annotations

import math

from host.constants import METRES_PER_DEG, RAD_PER_DEG
from host.live.gps_fix import GpsFix

_LEAST_SPEED_MPS = 8.0  # below it the airspeed says nothing
_LEAST_GROUND_MPS = 4.0  # over ground: slower it stands, is carried, or hovers against the wind
_MEMORY_S = 20.0  # of the wind's running mean: a circle of a trainer
_GPS_S = 0.2
_KEPT = 6000  # positions: 20 min at 5 Hz; then every second of the older half goes


class LiveTrack:
    """Positions in metres east and north of the first fix, and a running estimate of the wind.

    Parameters
    ----------
    points : list of (float, float, float)
        East, north, height above home; metres.
    places : list of (float, float, float)
        Latitude, longitude (deg), height above mean sea level (m), of the same positions.
    wind_mps : (float, float) or None
        Where the air goes: east, north.
    """

    def __init__(self) -> None:
        self.points: list[tuple[float, float, float]] = []
        self.places: list[tuple[float, float, float]] = []
        self.wind_mps: tuple[float, float] | None = None
        self.home: tuple[float, float, float] | None = None
        self.made = 0

    def add(self, fix: GpsFix, airspeed_mps: float, theta: float, psi: float) -> None:
        """Take a position with airspeed (m/s), pitch and heading (rad) of its instant."""
        place = fix.place
        if place is None:
            return
        if self.home is None:
            self.home = place
        east, north = local_m(place, self.home)
        self.points.append((east, north, place[2] - self.home[2]))
        self.places.append(place)
        self.made += 1
        if len(self.points) > _KEPT:
            del self.points[: _KEPT // 2 : 2], self.places[: _KEPT // 2 : 2]
        self._wind(fix.velocity_mps[1], fix.velocity_mps[0], airspeed_mps, theta, psi)

    def _wind(self, east: float, north: float, speed: float, theta: float, psi: float) -> None:
        flies = speed > _LEAST_SPEED_MPS and math.hypot(east, north) > _LEAST_GROUND_MPS
        if not (flies and math.isfinite(theta) and math.isfinite(psi)):
            return
        level = speed * math.cos(theta)
        now = east - level * math.sin(psi), north - level * math.cos(psi)
        if self.wind_mps is None:
            self.wind_mps = now
        share = _GPS_S / _MEMORY_S
        old = self.wind_mps
        self.wind_mps = old[0] + share * (now[0] - old[0]), old[1] + share * (now[1] - old[1])


def local_m(
    place: tuple[float, float, float], home: tuple[float, float, float]
) -> tuple[float, float]:
    """Return metres east and north of home on a sphere: 0.3 % off within a few km."""
    north = (place[0] - home[0]) * METRES_PER_DEG
    east = (place[1] - home[1]) * METRES_PER_DEG * math.cos(home[0] * RAD_PER_DEG)
    return east, north
