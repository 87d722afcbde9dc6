"""Turn original rows into the synchronous table; known faults are corrected or marked invalid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.original.row_rate import RowRate, row_rate
from host.original.rows import OriginalRows
from host.physical.airdata import calibrated_airspeed_mps
from host.physical.calibration import Calibration
from host.physical.channels import unwrapped
from host.physical.columns import COLUMNS

Array = NDArray[np.float64]

NOTES = (
    "row times are row numbers over a rate: {rate}",
    "surfaces are commands through the original map, not positions; its rudder jumps by 2.02 deg"
    " near neutral",
    "airspeed assumes sea-level density: the rows carry no static pressure",
    "IMU values are one to two rows old and repeat every other row",
)
_SEA_LEVEL_KGPM3 = 1.225
_OVERFLOW = 65536
_FACTOR, _DIVISOR = 90, 27  # analogRead * 90 / 27 in int16 arithmetic
_FREE_TURN_COUNTS = 307  # limiters of the vanes: 90 deg of a 300 deg potentiometer of 1024 counts
_MID_SCALE_COUNT = 512.0  # where a vane or pot without a start value stands at rest
_THROTTLE_OFFSET_US = 1009.0


@dataclass(frozen=True, slots=True)
class RowTable:
    """The table of a file of original rows.

    Parameters
    ----------
    columns : dict of str to NDArray, shape (n,)
        The columns of `host.physical.columns.COLUMNS`; NaN where the rows have nothing.
    rate : RowRate
        Rate from which ``t_s`` is computed; NaN if unknown.
    undone : dict of str to int
        By label, values whose int16 overflow was undone.
    ambiguous : dict of str to int
        By label, values that two counts explain: marked invalid.
    """

    columns: dict[str, NDArray[Any]]
    rate: RowRate
    undone: dict[str, int]
    ambiguous: dict[str, int]


def make_table(
    rows: OriginalRows, calibration: Calibration, rate_hz: float | None = None
) -> RowTable:
    """Turn original rows into the synchronous table.

    Parameters
    ----------
    rows : OriginalRows
    calibration : Calibration
    rate_hz : float, optional
        Rows per second; without it estimated from GPS, or unknown. The thesis flew at 10 and 20,
        our own recorder prints such rows at 5: their text does not tell which.

    Returns
    -------
    RowTable
    """
    rate = row_rate(rows, rate_hz)
    count = len(rows)
    nothing = np.full(count, np.nan)
    out: dict[str, NDArray[Any]] = {column.name: nothing for column in COLUMNS}
    out["t_s"] = np.arange(count) / rate.rate_hz
    out["session"] = np.ones(count, np.int64)
    out["mega_drives"] = np.ones(count, np.int8)  # receiver -> Mega -> servo, always
    undone: dict[str, int] = {}
    ambiguous: dict[str, int] = {}
    _vanes(rows, calibration, out, undone, ambiguous)
    _inertial(rows, calibration, out)
    _speeds(rows, out)
    _surfaces(rows, out)
    _gps(rows, out)
    out["altitude_m"] = rows.values["altitude"]
    return RowTable(out, rate, undone, ambiguous)


def printed_vane(count: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return what ``analogRead * 90 / 27`` prints on the AVR: int16, division towards zero."""
    product = (count * _FACTOR + _OVERFLOW // 2) % _OVERFLOW - _OVERFLOW // 2
    return np.asarray(np.sign(product) * (np.abs(product) // _DIVISOR), np.int64)


def undo_vane(printed: Array) -> Array:
    """Return the ADC count behind a printed vane or pot value, NaN where it is not unique.

    Parameters
    ----------
    printed : Array
        Values printed without a start value subtracted (variant of 27 readings).
    """
    counts = np.arange(1024)
    values = printed_vane(counts)
    unique, first, times = np.unique(values, return_index=True, return_counts=True)
    place = np.clip(np.searchsorted(unique, printed), 0, len(unique) - 1)
    good = (unique[place] == printed) & (times[place] == 1)
    return np.where(good, first[place].astype(np.float64), np.nan)


def undo_relative_vane(printed: Array) -> Array:
    """Return counts from the start position behind a printed value that has it subtracted.

    The overflow adds or takes 65536/27 printed units, 728 counts; with vanes that turn no more
    than 90 deg (307 counts) from where they started, at most one of the three fits.

    Parameters
    ----------
    printed : Array
        Values of the variants with 23 and 26 readings.
    """
    per_count = _FACTOR / _DIVISOR
    wrap = _OVERFLOW / _FACTOR
    counts = printed / per_count
    out = np.full(len(printed), np.nan)
    for shift in (0.0, wrap, -wrap):
        fits = np.abs(counts + shift) <= _FREE_TURN_COUNTS
        out[fits] = counts[fits] + shift
    return out


def _vanes(
    rows: OriginalRows,
    calibration: Calibration,
    out: dict[str, NDArray[Any]],
    undone: dict[str, int],
    ambiguous: dict[str, int],
) -> None:
    absolute = rows.variant == "27 readings"
    targets = {
        "alpha": "alpha_a_rad",
        "beta": "beta_a_rad",
        "alphaa": "alpha_a_rad",
        "alphab": "alpha_b_rad",
        "betaa": "beta_a_rad",
        "betab": "beta_b_rad",
        "elev": "elevator_pot_rad",
        "ail": "aileron_left_rad",
        "rdr": "rudder_pot_rad",
    }
    line = calibration.lines["original.vane"]
    middle = _MID_SCALE_COUNT if absolute else 0.0
    for label, column in targets.items():
        if label not in rows.values:
            continue
        printed = rows.values[label]
        counts = undo_vane(printed) if absolute else undo_relative_vane(printed)
        known = np.isfinite(counts)
        undone[label] = int(np.count_nonzero(known & _overflowed(printed, counts, absolute)))
        ambiguous[label] = int(np.count_nonzero(np.isfinite(printed) & ~known))
        out[column] = (counts - middle - line.zero[0]) * line.slope[0]
    for name in ("alpha", "beta"):
        pair = np.array([out[f"{name}_a_rad"], out[f"{name}_b_rad"]])
        good = np.isfinite(pair)
        total = np.where(good, pair, 0.0).sum(axis=0)
        number = good.sum(axis=0)
        out[f"{name}_rad"] = np.where(number > 0, total / np.maximum(number, 1), np.nan)


def _overflowed(printed: Array, counts: Array, absolute: bool) -> NDArray[np.bool_]:
    straight = printed * (_DIVISOR / _FACTOR)
    near = np.abs(np.where(np.isfinite(counts), counts, straight) - straight)
    return np.asarray(near > (1.0 if absolute else 0.5))


def _inertial(rows: OriginalRows, calibration: Calibration, out: dict[str, NDArray[Any]]) -> None:
    names = ("p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2")
    for at, column in enumerate(names):
        line = calibration.lines["imu_original.gyro" if at < 3 else "imu_original.accel"]
        axis = at % 3
        out[column] = (rows.values[f"AN{at}"] - line.zero[axis]) * line.slope[axis]
    for label, column in (("RLL", "phi_rad"), ("PCH", "theta_rad"), ("YAW", "psi_rad")):
        out[column] = unwrapped(np.deg2rad(rows.values[label]))


def _speeds(rows: OriginalRows, out: dict[str, NDArray[Any]]) -> None:
    pairs = (("velocity", "a"), ("velocitya", "a"), ("velocityb", "b"))
    impact = []
    for label, side in pairs:
        if label in rows.values:
            speed_mps = rows.values[label] / 3.6  # printed in km/h: V = airspeed * 18 / 5
            pressure = 0.5 * _SEA_LEVEL_KGPM3 * speed_mps**2
            out[f"differential_{side}_pa"] = pressure
            impact.append(pressure)
    both = np.array(impact)
    good = np.isfinite(both)
    number = good.sum(axis=0)
    mean = np.where(good, both, 0.0).sum(axis=0) / np.maximum(number, 1)
    mean[number == 0] = np.nan
    out["qbar_pa"] = mean
    out["cas_mps"] = calibrated_airspeed_mps(mean)
    out["airspeed_mps"] = np.sqrt(2.0 * mean / _SEA_LEVEL_KGPM3)


def _surfaces(rows: OriginalRows, out: dict[str, NDArray[Any]]) -> None:
    rudder = "ruds" if "ruds" in rows.values else "rdrs"
    for label, column in (
        ("elevs", "elevator_rad"),
        ("ails", "aileron_rad"),
        (rudder, "rudder_rad"),
    ):
        out[column] = np.deg2rad(rows.values[label])
    throttle = (rows.values["throts"] + _THROTTLE_OFFSET_US - 1000.0) / 1000.0
    throttle[(throttle < -1e-9) | (throttle > 1.0 + 1e-9)] = np.nan  # before the first pulse
    out["throttle"] = throttle


def _gps(rows: OriginalRows, out: dict[str, NDArray[Any]]) -> None:
    lost = ~(rows.values["fix"] > 0.0)
    for label, column in (
        ("lat", "latitude_deg"),
        ("lon", "longitude_deg"),
        ("gpsalt", "gps_height_m"),
        ("gpsgs", "ground_speed_mps"),
    ):
        if label in rows.values:
            value = rows.values[label].copy()
            value[lost] = np.nan
            out[column] = value
