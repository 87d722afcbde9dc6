"""A sensor that stands still while it must move: kinematics, or its own noise, says so.

A value that repeats is no fault: quantised ones do in quiet flight. It is one where the motion that
other sensors show moves it by more than they usually miss it, or where its noise never rests.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.aircraft.attitude import euler_rates
from host.arrays import Array, BoolArray
from host.constants import GRAVITY_MPS2
from host.readers.column_sampling import runs
from host.sysid.checks.kinematic_identities import STEEPEST_RAD

USUALLY, MISSED = 0.95, 1.5  # of the windows as long; times the most that they miss
STEPS = 3.0  # of a quantised value, that motion must cross
RESTLESS = 0.05  # of the windows: noise that moves the sensor in all others never rests
JUMP = 2.0  # times the largest change from row to row: what a logger filled in
SMOOTH_S = 0.2
SLOPE_OF = {"q_radps": "theta_rad", "p_radps": "phi_rad", "r_radps": "psi_rad"}
# Motion below this is none, by the end of a column's name.
LEAST = {"rad": 0.02, "radps": 0.05, "mps2": 0.5, "mps": 0.5}


def stuck_runs(
    columns: Mapping[str, Array], name: str, step: float, longest_s: float
) -> list[tuple[int, int]]:
    """Return first row and the row behind the last of every run in which a sensor is stuck.

    Parameters
    ----------
    columns : mapping
        `t_s` and SI columns as recorded, NaN where nothing was.
    name : str
        The sensor.
    step : float
        Step of its numbers; 0 where none is seen.
    longest_s : float
        It may stand still for as long.
    """
    t, values = columns["t_s"], columns[name]
    starts, lengths = runs(values)
    ends = starts + lengths
    long = (t[ends - 1] - t[starts] > longest_s) & np.isfinite(values[starts])
    if not long.any():
        return []
    elsewhere = np.ones(len(t), dtype=bool)
    for first, end in zip(starts[long], ends[long], strict=True):
        elsewhere[first:end] = False
    expected = expected_motion(columns, name)
    noisy = _is_noisy(values[elsewhere], step)
    found = []
    for first, end in zip(starts[long], ends[long], strict=True):
        rows = int(end - first)
        own = _moved(values, rows, elsewhere)
        restless = noisy and len(own) > 0 and float(np.quantile(own, RESTLESS)) > STEPS * step
        must = False
        if expected is not None:
            measured = _smooth(values, t) if name in SLOPE_OF else values
            missed = _moved(measured - expected, rows, elsewhere)
            usual = float(np.quantile(missed, USUALLY)) if len(missed) else 0.0
            least = max(LEAST[name.rsplit("_", 1)[-1]], STEPS * step, MISSED * usual)
            reach = _reach(t) if name in SLOPE_OF else 0  # a mean knows what comes
            within = expected[first + reach : end - reach]
            must = len(within) > 2 and _swing(within, detrended=len(missed) == 0) > least
        filled = _jumps(values, int(first), int(end), elsewhere) > JUMP
        if must or ((restless or filled) and _others_move(columns, name, int(first), int(end))):
            found.append((int(first), int(end)))
    return found


def _jumps(values: Array, first: int, end: int, elsewhere: BoolArray) -> float:
    """Return how much further a sensor jumps to a value that stays, and back, than ever else."""
    if first == 0 or end == len(values):
        return 0.0
    change = np.abs(np.diff(values))
    usual = change[elsewhere[1:] & elsewhere[:-1] & np.isfinite(change)]
    most = float(np.max(usual, initial=0.0))
    return float(min(change[first - 1], change[end - 1])) / most if most > 0.0 else 0.0


def _is_noisy(values: Array, step: float) -> bool:
    """Return whether a sensor never rests: noise turns back from row to row, motion does not."""
    values = values[np.isfinite(values)]
    if len(values) < 3:
        return False
    change = float(np.median(np.abs(np.diff(values))))
    return change > step and float(np.median(np.abs(np.diff(values, n=2)))) > change


def _swing(values: Array, *, detrended: bool) -> float:
    """Return the range of values, for a record without any other part about their trend."""
    if detrended and len(values) > 2:
        rows = np.arange(len(values), dtype=np.float64)
        values = values - np.polyval(np.polyfit(rows, values, 1), rows)
    return float(np.ptp(values))


def _moved(values: Array, rows: int, usable: BoolArray) -> Array:
    """Return the range of the values within windows of so many rows, all of them usable."""
    count = len(values) // rows
    if count == 0:
        return np.empty(0)
    shaped = values[: count * rows].reshape(count, rows)
    whole = usable[: count * rows].reshape(count, rows).all(axis=1)
    whole &= np.isfinite(shaped).all(axis=1)
    return np.asarray(np.ptp(shaped[whole], axis=1))


def _others_move(columns: Mapping[str, Array], name: str, first: int, end: int) -> bool:
    """Return whether other sensors change from row to row: else the logger stood still."""
    moving = np.zeros(end - first - 1, dtype=np.int64)
    for other, values in columns.items():
        if other not in ("t_s", name):
            moving += np.diff(values[first:end]) != 0.0
    return bool(np.mean(moving > 0) > 0.5)


def expected_motion(columns: Mapping[str, Array], name: str) -> Array | None:
    """Return how the other sensors say that a sensor moves, up to a constant; None if they do not.

    Kinematics of a rigid body (EQUATIONS.md, eq. 6): angles and speed are integrals of
    rates and forces, rates and forces their slopes.
    """
    t, c = columns["t_s"], columns
    zero = np.zeros(len(t))
    phi, theta = c.get("phi_rad", zero), c.get("theta_rad", zero)
    alpha = c.get("alpha_rad", zero)
    p, q, r = (c.get(f"{k}_radps", zero) for k in "pqr")
    speed = np.maximum(c.get("airspeed_mps", zero), 1.0)
    weight = GRAVITY_MPS2 * np.cos(theta)
    level = "theta_rad" in c and "airspeed_mps" in c
    rolling, pitching, turning = euler_rates(
        phi, np.clip(theta, -STEEPEST_RAD, STEEPEST_RAD), p, q, r
    )
    rates = {
        "theta_rad": ("q_radps" in c, pitching),
        "phi_rad": ("p_radps" in c, rolling),
        "psi_rad": ("r_radps" in c, turning),
        "alpha_rad": (
            "q_radps" in c and "az_mps2" in c and level,
            q + (c.get("az_mps2", zero) + weight * np.cos(phi)) / speed,
        ),
        "beta_rad": (
            "r_radps" in c and "ay_mps2" in c and level,
            p * np.sin(alpha) - r * np.cos(alpha)
            + (c.get("ay_mps2", zero) + weight * np.sin(phi)) / speed,
        ),
        "airspeed_mps": (
            "ax_mps2" in c and "theta_rad" in c,
            c.get("ax_mps2", zero) - GRAVITY_MPS2 * np.sin(theta - alpha),
        ),
    }  # fmt: skip
    if name in rates:
        known, rate = rates[name]
        if not known:
            return None
        step_s = np.diff(t, prepend=t[0])
        return np.asarray(np.cumsum(np.nan_to_num(rate) * step_s))
    source = SLOPE_OF.get(name)
    if source is None or source not in c:
        return None
    angle = np.unwrap(np.nan_to_num(c[source]))
    return _smooth(np.gradient(angle, t), t)


def _reach(t: Array) -> int:
    return max(1, round(0.5 * SMOOTH_S / float(np.median(np.diff(t)))))


def _smooth(values: Array, t: Array) -> Array:
    """Return the means about each sample, over `SMOOTH_S`."""
    half = _reach(t)
    padded = np.pad(values, half, mode="edge")
    return np.convolve(padded, np.ones(2 * half + 1) / (2 * half + 1), mode="valid")
