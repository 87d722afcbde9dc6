"""Columns -> channels as people read them: degrees, a group, a short name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.constants import DEG_PER_RAD
from host.people_units import people_name, people_unit
from host.report.shown_flight import ShownFlight

_GROUPS = {
    "air data": ("airspeed", "cas", "alpha_", "beta_", "qbar", "differential", "static",
                 "temperature", "density", "altitude"),
    "rates and accelerations": ("p_", "q_", "r_", "ax_", "ay_", "az_"),
    "attitude": ("phi", "theta", "psi"),
    "surfaces": ("elevator", "aileron", "rudder", "throttle", "flap"),
    "sticks and servos": ("rc_", "servo_", "mega"),
    "GPS": ("latitude", "longitude", "gps", "v_", "ground_speed"),
}  # fmt: skip
_PAIRS = {
    "alpha_pair_deg": ("alpha_a_rad", "alpha_b_rad"),
    "beta_pair_deg": ("beta_a_rad", "beta_b_rad"),
    "pitot_pair_pa": ("differential_a_pa", "differential_b_pa"),
    "aileron_pair_deg": ("aileron_left_rad", "aileron_right_rad"),
}
_PAIR_TEXT = {
    "alpha_pair_deg": "left minus right vane",
    "beta_pair_deg": "left minus right vane",
    "pitot_pair_pa": "left minus right pitot",
    "aileron_pair_deg": "left plus right: zero while both move alike",
}
OTHER = "others"
PAIRED = "pairs"


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel; `values` shape (rows,), NaN where nothing was measured."""

    name: str
    unit: str
    text: str
    group: str
    values: Array


def channels_of(flight: ShownFlight) -> list[Channel]:
    """Return the channels of a flight, angles in degrees, differences of pairs behind them."""
    found = []
    for name, values in flight.columns.items():
        if name == "t_s" or not len(values):
            continue
        called, factor = people_name(name)
        unit, _ = people_unit(flight.units.get(name, ""))
        text, values = flight.texts.get(name, ""), np.asarray(values, np.float64)
        values = values if factor == 1.0 else values * factor
        found.append(Channel(called, unit, text, _group(name), values))
    return found + _differences(flight)


def shown_name(column: str) -> str:
    """Return the name under which a column is shown."""
    return people_name(column)[0]


def _group(name: str) -> str:
    for group, beginnings in _GROUPS.items():
        if name.startswith(beginnings):
            return group
    return OTHER


def _differences(flight: ShownFlight) -> list[Channel]:
    found = []
    for name, (a, b) in _PAIRS.items():
        if a in flight.columns and b in flight.columns:
            left, right = flight.columns[a], flight.columns[b]
            values = left + right if name.startswith("aileron") else left - right
            scale, unit = (DEG_PER_RAD, "deg") if name.endswith("_deg") else (1.0, "Pa")
            found.append(Channel(name, unit, _PAIR_TEXT[name], PAIRED, scale * values))
    return found
