"""A record in which no maneuver is found, though surfaces moved: all of the flight is fitted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.constants import DEG_PER_RAD
from host.sysid.checks.data_finding import Finding
from host.sysid.maneuvers.maneuver_detection import FLYING_SHARE, STILL_RAD, DetectedManeuver
from host.sysid.maneuvers.maneuver_selection import FEWEST, SURFACES, select_maneuvers


def whole_flight(columns: Mapping[str, Array]) -> tuple[list[DetectedManeuver], list[Finding]]:
    """Return the whole flight as one stretch, and why; nothing where no surface moved.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    """
    t = columns["t_s"]
    flown = np.ones(len(t), dtype=bool)
    if "airspeed_mps" in columns:
        speed = np.abs(columns["airspeed_mps"])
        flown = speed > FLYING_SHARE * float(np.median(speed))
    swing = {s: float(np.ptp(columns[s][flown])) for s in SURFACES if s in columns and flown.any()}
    if flown.sum() < FEWEST or max(swing.values(), default=0.0) < STILL_RAD:
        return [], []
    first, last = np.flatnonzero(flown)[[0, -1]]
    moved = ", ".join(f"{name} {DEG_PER_RAD * size:.2g} deg" for name, size in swing.items())
    finding = Finding(
        "small-inputs",
        (),
        f"no maneuver stands out of the record (from end to end move {moved})",
        ("small inputs", "a flight without test points", "surfaces in another unit"),
        f"all of it, {t[first]:.6g} to {t[last]:.6g} s, is fitted as one stretch",
    )
    interval_s = float(t[first]), float(t[last])
    return select_maneuvers(columns, stretches=[interval_s]), [finding]
