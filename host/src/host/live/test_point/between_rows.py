"""Rows of the radio drawn to the rate of the card's log, by what the aircraft does between two.

Twenty rows a second miss the edges of an input, and a burst of lost envelopes takes more. The
card's aircraft, its servos and the pulses that they got predict both: a smoother follows them from
row to row, and a curve is drawn only through what it leaves of the rows.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from host.arrays import Array
from host.errors import IdentificationError
from host.physical.sampling import GAP_FACTOR
from host.planning.aircraft_response import STEP_S, AircraftResponse
from host.sysid.reconstruction.linear_smoother import Step, smooth
from host.sysid.reconstruction.servo_response import servo_response
from host.twin.testcard.cards import Segment

FEWEST = 30  # rows: 1.5 s of the radio
REST_S = 1.5  # from the first row on: what the motion is counted from
ANGLE_SD, RATE_SD, POT_SD = 0.0015, 0.004, 0.0015  # rad, rad/s; attitude as rates
# A pulse lasts until the next, 20 ms later: on an edge a row may have either.
PULSE_SD_RAD, PULSE_SD_S = 0.0012, 0.006
# Variances a second of what the linear aircraft does not know: forces, pitch or roll, gusts (the
# change of 0.08 m/s in 0.25 s of a calm morning) and surfaces.
FORCE_POWER, MOMENT_POWER, GUST_POWER = 0.05**2, 0.3**2, 0.078**2 / 0.25
SURFACE_POWER = 0.003**2
# A stick moves for the time of an edge: what did not arrive for longer is a line.
EDGE_S, EDGE_RADPS = 0.04, 0.8
FIRST_SD = (1.0, 0.5, 0.2, 0.1, 0.3)  # of motion and gust at the first row
FIRST_SURFACE_SD = (0.02, 0.02, 0.3)  # of a surface, its stick and the stick's rate
# Columns of the pots that are a surface: where they differ, it counts as commanded.
POTS = {
    "elevator_pot_rad": ("elevator_rad", 1.0), "aileron_left_rad": ("aileron_rad", 1.0),
    "aileron_right_rad": ("aileron_rad", -1.0), "rudder_pot_rad": ("rudder_rad", 1.0),
}  # fmt: skip


class _Axis(NamedTuple):
    """Columns of one axis; places among the states of `host.aircraft.linearisation.Linear`."""

    surfaces: tuple[str, ...]
    angle: str
    velocity: int  # across the airspeed: with a gust, the angle
    rates: dict[str, int]
    moment: int  # the rate that surfaces change first


LONGITUDINAL = _Axis(("elevator",), "alpha_rad", 1, {"q_radps": 2, "theta_rad": 3}, 2)
LATERAL = _Axis(("aileron", "rudder"), "beta_rad", 0, {"p_radps": 1, "r_radps": 2, "phi_rad": 3}, 1)
GUST, FIRST_SURFACE = 4, 5  # places behind the motion; each surface has three


class _Seen(NamedTuple):
    """What rows show of the states: a row of the matrix, values and deviations of each row."""

    name: str
    by: Array
    values: Array
    sd: Array


def finer(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table at the rate of the card's log, curves drawn between its rows.

    Parameters
    ----------
    table : DataFrame
        SI, as `host.read_log(...).table()` returns it.

    Raises
    ------
    IdentificationError
        Too few rows.
    """
    if len(table) < FEWEST:
        raise IdentificationError(f"{len(table)} rows arrived, {FEWEST} are needed")
    t = table["t_s"].to_numpy(np.float64)
    at = np.arange(t[0], t[-1], STEP_S)
    out: dict[str, Array] = {"t_s": at}
    for name in table.columns.drop("t_s"):
        values = _column(table, name)
        known = np.isfinite(values)
        if known.sum() < FEWEST:
            continue
        own, series = t[known], values[known]
        out[name] = np.interp(at, own, series)
        gaps = np.diff(own)
        if known.mean() > 0.5:  # of every row: not those of a slower sensor
            near = gaps[np.clip(np.searchsorted(own, at) - 1, 0, len(gaps) - 1)]
            curve = CubicSpline(own, series)(at)
            even = (near < GAP_FACTOR * np.median(gaps)) & (at <= own[-1])
            out[name] = np.where(even, curve, out[name])
    return pd.DataFrame(out)


@dataclass(frozen=True, slots=True)
class DrawnRows:
    """Rows at the rate of the card's log.

    Attributes
    ----------
    by_curves : DataFrame
        Curves through the rows, and the motion where rows are missing.
    by_motion : DataFrame
        The motion everywhere, and curves through what it leaves of the rows.
    """

    by_curves: pd.DataFrame
    by_motion: pd.DataFrame


def drawn_rows(
    table: pd.DataFrame, point: Segment, response: AircraftResponse, since_s: float
) -> DrawnRows:
    """Return a table at the rate of the card's log.

    Parameters
    ----------
    table : DataFrame
        SI, as `host.read_log(...).table()` returns it.
    point : Segment
        Its surfaces tell the axis that moves.
    response : AircraftResponse
    since_s : float
        From where on the motion is followed; the aircraft is trimmed then.

    Raises
    ------
    IdentificationError
        Too few rows.
    """
    curves = finer(table)
    axis = LONGITUDINAL if "elevator" in point.axes else LATERAL
    t = table["t_s"].to_numpy(np.float64)
    own = table[t >= since_s]
    if len(own) < FEWEST:
        raise IdentificationError(f"{len(own)} rows arrived, {FEWEST} are needed")
    seen = _seen(own, axis, response)
    at = np.arange(float(own["t_s"].iloc[0]), t[-1] + STEP_S, STEP_S)
    states = _states(at, own["t_s"].to_numpy(np.float64), seen, axis, response)
    motion = {one.name: states @ one.by for one in seen if one.name in curves}
    rest = table.assign(
        **{n: _column(table, n) - np.interp(t, at, drawn) for n, drawn in motion.items()}
    )
    drawn_at = curves["t_s"].to_numpy(np.float64)
    gap = np.diff(t)[np.clip(np.searchsorted(t, drawn_at) - 1, 0, len(t) - 2)]
    missing = gap > GAP_FACTOR * np.median(np.diff(t))
    out = finer(rest)
    for name, drawn in motion.items():
        out[name] += np.interp(drawn_at, at, drawn)
        curves[name] = np.where(missing, out[name], curves[name])
    return DrawnRows(_with_pots(curves, motion), _with_pots(out, motion))


def _with_pots(table: pd.DataFrame, motion: Collection[str]) -> pd.DataFrame:
    return table.assign(
        **{pot: sign * table[of] for pot, (of, sign) in POTS.items() if of in motion}
    )


def _seen(own: pd.DataFrame, axis: _Axis, response: AircraftResponse) -> list[_Seen]:
    """Return what the rows show: the angle, rates and attitude, surfaces and their pulses."""
    t = own["t_s"].to_numpy(np.float64)
    size = FIRST_SURFACE + 3 * len(axis.surfaces)
    unit, speed = np.eye(size), response.airspeed_mps
    angle = (unit[axis.velocity] - unit[GUST]) / speed
    found = [_from_rest(axis.angle, angle, t, _column(own, axis.angle), ANGLE_SD)]
    for name, place in axis.rates.items():
        found.append(_from_rest(name, unit[place], t, _column(own, name), RATE_SD))
    for k, surface in enumerate(axis.surfaces):
        pot, name = _column(own, f"{surface}_rad"), f"{surface}_rad"
        place = FIRST_SURFACE + 3 * k
        found.append(_from_rest(name, unit[place], t, pot, POT_SD))
        stick = _commanded(t, _pulses(own, surface), pot, response.servo_radps)
        if stick is not None:
            edge = PULSE_SD_S * np.gradient(np.nan_to_num(stick), t)
            sd = np.hypot(PULSE_SD_RAD, edge)
            found.append(_from_rest(f"{surface} stick", unit[place + 1], t, stick, sd))
    return found


def _from_rest(name: str, by: Array, t: Array, values: Array, sd: float | Array) -> _Seen:
    """Return values from those of the rest at the beginning."""
    rest = values[(t <= t[0] + REST_S) & np.isfinite(values)]
    level = float(np.median(rest)) if len(rest) else np.nan
    return _Seen(name, by, values - level, np.broadcast_to(sd, t.shape))


def _pulses(own: pd.DataFrame, surface: str) -> Array:
    """Return the pulse that the servo gets, us: the Mega's or the receiver's."""
    drives = _column(own, "mega_drives") > 0.5
    return np.where(drives, _column(own, f"servo_{surface}_us"), _column(own, f"rc_{surface}_us"))


def _commanded(t: Array, pulses_us: Array, pot_rad: Array, servo_radps: float) -> Array | None:
    """Return pulses as angles of the surface, by what its pot made of them; None without."""
    known, measured = np.isfinite(pulses_us), np.isfinite(pot_rad)
    if known.sum() < FEWEST or measured.sum() < FEWEST or np.ptp(pulses_us[known]) == 0.0:
        return None
    at = np.arange(t[0], t[-1] + STEP_S, STEP_S)
    drawn = np.interp(at, t[known], pulses_us[known])
    behind = np.interp(t, at, servo_response(drawn, STEP_S, servo_radps / (2.0 * np.pi), 0.0))
    slope, zero = np.polyfit(behind[measured], pot_rad[measured], 1)
    return np.asarray(slope * pulses_us + zero)


def _states(
    at: Array, t: Array, seen: list[_Seen], axis: _Axis, response: AircraftResponse
) -> Array:
    """Return motion, gust and surfaces every `STEP_S`, (m, states), given all rows."""
    size = FIRST_SURFACE + 3 * len(axis.surfaces)
    by = np.stack([one.by for one in seen])
    values, sd = (np.stack([one[k] for one in seen], axis=1) for k in (2, 3))
    row_at = {round((at_s - at[0]) / STEP_S): row for row, at_s in enumerate(t.tolist())}
    F, power = _transition(axis, response), _power(axis)
    none, known = Step(F, np.zeros(size), power, *_nothing(size)), np.isfinite(values)
    steps = []
    for k in range(len(at)):
        row = row_at.get(k)
        if row is None:
            steps.append(none)
            continue
        here = known[row]
        steps.append(none._replace(H=by[here], seen=values[row, here], sd=sd[row, here]))
    first = np.array([*FIRST_SD, *FIRST_SURFACE_SD * len(axis.surfaces)])
    means, _ = smooth(np.zeros(size), np.diag(first**2), steps)
    return means


def _nothing(size: int) -> tuple[Array, Array, Array]:
    return np.zeros((0, size)), np.zeros(0), np.zeros(0)


def _transition(axis: _Axis, response: AircraftResponse) -> Array:
    """Return the step of motion, gust (moving air of constant speed) and servos behind sticks."""
    linear = response.linear
    A, B = (
        (linear.longitudinal_a, linear.longitudinal_b)
        if axis is LONGITUDINAL
        else (linear.lateral_a, linear.lateral_b)
    )
    size = FIRST_SURFACE + 3 * len(axis.surfaces)
    rates = np.zeros((size, size))
    rates[:4, :4], rates[:4, GUST] = A, -A[:, axis.velocity]
    for k in range(len(axis.surfaces)):
        surface = FIRST_SURFACE + 3 * k
        rates[:4, surface] = B[:, k]
        rates[surface, surface : surface + 2] = -response.servo_radps, response.servo_radps
        rates[surface + 1, surface + 2] = 1.0
        rates[surface + 2, surface + 2] = -1.0 / EDGE_S
    return np.asarray(expm(rates * STEP_S))


def _power(axis: _Axis) -> Array:
    """Return the variances that a step adds."""
    motion = np.array([FORCE_POWER, FORCE_POWER, FORCE_POWER, 0.0, GUST_POWER])
    motion[axis.moment] = MOMENT_POWER
    surface = (SURFACE_POWER, 0.0, 2.0 * EDGE_RADPS**2 / EDGE_S)
    return STEP_S * np.array([*motion, *surface * len(axis.surfaces)])


def _column(table: pd.DataFrame, name: str) -> Array:
    if name not in table:
        return np.full(len(table), np.nan)
    return pd.to_numeric(table[name], errors="coerce").to_numpy(np.float64)
