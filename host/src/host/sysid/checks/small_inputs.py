"""A record in which no maneuver is found, though surfaces moved: all of the flight is fitted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array, BoolArray
from host.constants import DEG_PER_RAD
from host.sysid.checks.data_finding import Finding
from host.sysid.maneuvers.maneuver_detection import (
    FEWEST,
    FLYING_SHARE,
    STILL_RAD,
    DetectedManeuver,
)
from host.sysid.maneuvers.maneuver_selection import SURFACES, select_maneuvers


def whole_flight(columns: Mapping[str, Array]) -> tuple[list[DetectedManeuver], list[Finding]]:
    """Return the whole flight as one stretch, and why; nothing where no surface moved.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    """
    t, flown = columns["t_s"], _flown(columns)
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
    return _one_stretch(columns, flown), [finding]


def free_motion(columns: Mapping[str, Array]) -> list[DetectedManeuver]:
    """Return the whole flight as one stretch, for a model that nothing drives; nothing where
    surfaces were recorded, for maneuvers are found by them.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    """
    flown = _flown(columns)
    recorded = any(name in columns for name in SURFACES)
    return [] if recorded or flown.sum() < FEWEST else _one_stretch(columns, flown)


def _flown(columns: Mapping[str, Array]) -> BoolArray:
    if "airspeed_mps" not in columns:
        return np.ones(len(columns["t_s"]), dtype=bool)
    speed = np.abs(columns["airspeed_mps"])
    return np.asarray(speed > FLYING_SHARE * float(np.median(speed)))


def _one_stretch(columns: Mapping[str, Array], flown: BoolArray) -> list[DetectedManeuver]:
    first, last = columns["t_s"][np.flatnonzero(flown)[[0, -1]]]
    return select_maneuvers(columns, stretches=[(float(first), float(last))])
