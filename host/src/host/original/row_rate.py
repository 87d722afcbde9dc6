"""Rows per second: as given, or estimated from GPS positions and ground speed.

A row carries no time. Over a stretch of rows the distance between two positions is the sum of the
ground velocities times the time of a row. Least squares over stretches gives that time, and the
scatter between stretches its uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.constants import METRES_PER_DEG
from host.original.rows import OriginalRows

Array = NDArray[np.float64]

GIVEN, GPS, UNKNOWN = "given", "GPS", "unknown"
SEGMENTS = 8
FEWEST_ROWS = 10  # of a stretch: a GPS of the time says something new every fourth row
LEAST_WAY_M = 20.0  # of a stretch, in the mean: positions are printed to 1 m
MOST_SHARE = 0.15  # largest relative half-width with which a rate still serves as a time base
SLOWEST_MPS = 2.0  # below this speed GPS course is noise


@dataclass(frozen=True, slots=True)
class RowRate:
    """Rows per second and their origin.

    Attributes
    ----------
    rate_hz : float
        NaN where nobody knows.
    half_width_hz : float
        Half-width of the two-sided 95 % interval; 0 of a rate that was given.
    origin : str
        ``given``, ``GPS`` or ``unknown``.
    """

    rate_hz: float
    half_width_hz: float
    origin: str

    @property
    def known(self) -> bool:
        """Whether rows have times."""
        return self.origin != UNKNOWN

    @property
    def text(self) -> str:
        """In words."""
        if self.origin == GIVEN:
            return f"{self.rate_hz:g} Hz, as given"
        if self.origin == GPS:
            return (
                f"{self.rate_hz:.2f} +- {self.half_width_hz:.2f} Hz (95 %), estimated from the way"
                " that GPS saw against its ground speed"
            )
        return "unknown: rows carry no time, and GPS saw no way to tell it from; give --row-rate"


def row_rate(rows: OriginalRows, given_hz: float | None) -> RowRate:
    """Return the rate of rows.

    Parameters
    ----------
    rows : OriginalRows
    given_hz : float, optional
        As the user knows it: taken as it is.
    """
    if given_hz is not None:
        return RowRate(given_hz, 0.0, GIVEN)
    ways = _distances(rows)
    unknown = RowRate(float("nan"), float("nan"), UNKNOWN)
    if ways is None:
        return unknown
    way_m, sums_mps = ways
    if float(np.mean(np.linalg.norm(way_m, axis=1))) < LEAST_WAY_M:
        return unknown
    along = np.sum(way_m * sums_mps, axis=1)
    weight = np.sum(sums_mps**2, axis=1)
    row_s = float(along.sum() / weight.sum())
    count = len(along)
    from scipy import stats  # here: it takes a second to load, and most logs have no rows

    left = along - row_s * weight
    error_s = float(np.sqrt(np.sum(left**2) * count / (count - 1.0)) / weight.sum())
    half = float(stats.t.ppf(0.975, count - 1)) * error_s
    if not (row_s > 0.0 and half < MOST_SHARE * row_s):
        return unknown
    return RowRate(1.0 / row_s, half / row_s**2, GPS)


def _distances(rows: OriginalRows) -> tuple[Array, Array] | None:
    """Return the distance (m) and the summed velocity (m/s) of each stretch, (k, 2) each."""
    wanted = ("fix", "lat", "lon", "gpsgc", "gpsgs")
    if any(label not in rows.values for label in wanted):
        return None
    fix, latitude, longitude, course, speed = (rows.values[label] for label in wanted)
    good = (fix > 0.0) & np.isfinite(latitude + longitude + course + speed)
    flown = good & (speed > SLOWEST_MPS)
    if np.count_nonzero(flown) < SEGMENTS * FEWEST_ROWS:
        return None
    first, last = np.flatnonzero(flown)[[0, -1]]
    at = np.arange(first, last + 1)
    known = np.flatnonzero(good)
    north, east = (
        np.interp(at, known, values[known] * METRES_PER_DEG * scale)
        for values, scale in (
            (latitude, 1.0),
            (longitude, np.cos(np.radians(np.median(latitude[known])))),
        )
    )
    angle = np.radians(course[known])
    velocity = [
        np.interp(at, known, speed[known] * part) for part in (np.cos(angle), np.sin(angle))
    ]
    ends = np.linspace(0, len(at) - 1, SEGMENTS + 1).astype(int)
    way = np.column_stack([np.diff(north[ends]), np.diff(east[ends])])
    cumulative = [np.concatenate([[0.0], np.cumsum(v[:-1])]) for v in velocity]
    sums = np.column_stack([np.diff(c[ends]) for c in cumulative])
    return way, sums
