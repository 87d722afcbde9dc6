"""Positions at GPS's own instants, and the date GPS gives a flight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from host.arrays import Array
from host.log import FlightLog
from host.physical.calibration import Calibration
from host.physical.timebase import gps_times_ms

_GPS_EPOCH_S = 315_964_800  # 1980-01-06 in seconds since 1970
_LEAP_S = 18  # between GPS and UTC since 2017 (IERS Bulletin C)
_LEAST_MS = 2000 * 604_800_000  # week 2000, 2018: an earlier week is a receiver that knows none


def log_position(log: FlightLog) -> dict[str, Array]:
    """Return time, latitude, longitude and height of every solution with a fix."""
    fixes = _fixes(log)
    frame = log.schema.by_name.get("gps")
    found: dict[str, list[Array]] = {name: [] for name in _NAMES}
    if frame is None:
        return {}
    for session in log.sessions:
        data, t_us = session.slow("gps")
        if not len(data):
            continue
        good = np.isin(data["fix"], fixes)
        for name in ("latitude", "longitude"):
            good &= data[name] != frame.field(name).invalid
        found["t_s"].append(session.seconds(t_us[good]))
        for name, field in _FIELDS.items():
            own = frame.field(field)
            value = data[field][good].astype(np.float64) * own.scale
            found[name].append(np.where(data[field][good] == own.invalid, np.nan, value))
    if not sum(map(len, found["t_s"])):
        return {}
    return {name: np.concatenate(parts) for name, parts in found.items()}


_FIELDS = {"latitude_deg": "latitude", "longitude_deg": "longitude", "height_m": "height"}
_NAMES = ("t_s", *_FIELDS)


def log_utc_s(log: FlightLog) -> float | None:
    """Return seconds since 1970 of ``t_s`` zero, None where GPS gave no week."""
    offsets = []
    for session in log.sessions:
        data, t_us = session.slow("gps")
        if len(data):
            at_ms = gps_times_ms(data, _fixes(log))
            good = (at_ms > _LEAST_MS) & (data["week"] != 0)
            offsets.append(at_ms[good] * 1e-3 - session.seconds(t_us[good]))
    every = np.concatenate(offsets) if offsets else np.empty(0)
    return float(np.median(every)) + _GPS_EPOCH_S - _LEAP_S if len(every) else None


def _fixes(log: FlightLog) -> tuple[int, ...]:
    return tuple(log.schema.number("gps_fix", word) for word in ("fix_2d", "fix_3d"))


def changed_position(columns: Mapping[str, Any]) -> dict[str, Array]:
    """Return the positions of a table, a row wherever one differs from the row before."""
    if not {"latitude_deg", "longitude_deg"} <= columns.keys():
        return {}
    latitude, longitude = columns["latitude_deg"], columns["longitude_deg"]
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not len(known):
        return {}
    new = (np.diff(latitude[known]) != 0.0) | (np.diff(longitude[known]) != 0.0)
    at = known[np.r_[True, new]]
    height = columns.get("gps_height_m", columns.get("altitude_m"))
    return {
        "t_s": np.asarray(columns["t_s"], np.float64)[at],
        "latitude_deg": np.asarray(latitude[at], np.float64),
        "longitude_deg": np.asarray(longitude[at], np.float64),
        "height_m": np.full(len(at), np.nan) if height is None else np.asarray(height[at]),
    }


def calibration_values(calibration: Calibration) -> dict[str, float]:
    """Return zero and slope of every line, an axis each where there are several."""
    found: dict[str, float] = {}
    for name, line in calibration.lines.items():
        for kind in ("zero", "slope"):
            values = getattr(line, kind)
            for axis, value in zip("xyz" if len(values) > 1 else " ", values, strict=False):
                found[f"{name}.{kind}{f'.{axis}' if len(values) > 1 else ''}"] = float(value)
    return found
