"""What a record holds of a flight: late, coarse and slow columns of sensors with errors."""

from __future__ import annotations

import math

import numpy as np
from host.arrays import Array
from scipy import signal

from studies.field_records.ranges import Draw
from studies.field_records.record_flight import RATE_HZ
from studies.foreign.flight import NOISE
from studies.foreign.instrument import Columns

ROW_HZ = 100
GROUPS = {
    "airspeed_late_s": ("airspeed_mps",),
    "vane_late_s": ("alpha_rad", "beta_rad"),
    "attitude_late_s": ("phi_rad", "theta_rad", "psi_rad"),
}
SURFACES = ("elevator_rad", "aileron_rad", "rudder_rad")
SLOW_LIKE = {"beta_rad": "alpha_rad", "phi_rad": "theta_rad", "psi_rad": "theta_rad"}


def columns_of(
    rows: Array, by: Draw, short_period_radps: float, rng: np.random.Generator
) -> Columns:
    """Return the columns of a record, 100 rows a second, without the errors of its sensors.

    Parameters
    ----------
    rows : Array
        From `record_flight.fly`.
    by : Draw
    short_period_radps : float
        Frequency of the aircraft's short period; the bending mode lies at about three times.
    rng : Generator
    """
    t = np.arange(len(rows)) / RATE_HZ
    rates, turning = rows[:, 3:6], rows[:, 22:25]
    speed, alpha, beta = rows[:, 19], rows[:, 20], rows[:, 21]
    ahead = by["vane_ahead_m"]
    up = speed * np.sin(alpha) - rates[:, 1] * ahead
    aside = speed * np.sin(beta) + rates[:, 2] * ahead
    off = np.full(3, by["imu_off_m"])
    force = rows[:, 16:19] + np.cross(turning, off) + np.cross(rates, np.cross(rates, off))
    found = {
        "airspeed_mps": speed,
        "alpha_rad": (1.0 + by["upwash"]) * np.arctan2(up, speed * np.cos(alpha)),
        "beta_rad": (1.0 + by["sidewash_at_vane"]) * np.arcsin(aside / speed),
        "p_radps": rates[:, 0],
        "q_radps": rates[:, 1] + bending(rows, by, short_period_radps),
        "r_radps": rates[:, 2],
        "phi_rad": rows[:, 6],
        "theta_rad": rows[:, 7],
        "psi_rad": rows[:, 8],
        "ax_mps2": force[:, 0],
        "ay_mps2": force[:, 1],
        "az_mps2": force[:, 2],
        **{name: rows[:, 28 + k] for k, name in enumerate(SURFACES)},
        "altitude_m": rows[:, 9],
    }
    late = {name: by[group] for group, names in GROUPS.items() for name in names}
    late |= dict.fromkeys(SURFACES, -by["command_early_s"])
    every = RATE_HZ // ROW_HZ
    record: Columns = {"t_s": t[::every]}
    for name, values in found.items():
        seen = np.interp(t - late.get(name, 0.0), t, values)[::every]
        seen = seen + NOISE.get(name, 0.0) * rng.standard_normal(len(seen))
        slow_hz = by.slow_hz.get(SLOW_LIKE.get(name, name), ROW_HZ)
        hold = (np.arange(len(seen)) // (ROW_HZ / slow_hz) * (ROW_HZ / slow_hz)).astype(int)
        record[name] = coarse(seen[hold], _step(name, by)).astype(np.float64)
    return record


def bending(rows: Array, by: Draw, short_period_radps: float) -> Array:
    """Return what the bending of the fuselage adds to the pitch rate at the gyro."""
    w = by["bending_over_short_period"] * short_period_radps
    below = [1.0, 2.0 * by["bending_damping"] * w, w * w]
    up, down = signal.bilinear([w * w, 0.0], below, RATE_HZ)
    rate = signal.lfilter(up, down, rows[:, 23])
    return np.asarray(by["bending_share"] * np.std(rows[:, 4]) / np.std(rate) * rate)


def coarse(values: Array, step: float) -> Array:
    """Return values in whole steps; as they are without one."""
    return np.asarray(np.round(values / step) * step if step else values)


def _step(name: str, by: Draw) -> float:
    if name in ("alpha_rad", "beta_rad"):
        return math.radians(by["vane_step_deg"])
    if name == "airspeed_mps":
        return by["airspeed_step_mps"]
    if name in ("p_radps", "q_radps", "r_radps"):
        return by["rate_step_radps"]
    return by["force_step_mps2"] if name in ("ax_mps2", "ay_mps2", "az_mps2") else 0.0
