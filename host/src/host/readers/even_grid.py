"""Columns of a flight on one even grid: rows in order, angles unwrapped, curves between slow
samples, lines over gaps.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.errors import IdentificationError
from host.physical.sampling import GAP_FACTOR, SLOW_US, bend
from host.readers.column_sampling import sampled_name
from host.readers.foreign_tables import from_frame

if TYPE_CHECKING:
    import pandas as pd

ANGLES = ("alpha_rad", "beta_rad", "phi_rad", "theta_rad", "psi_rad")
USED = (
    "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps",
    "ax_mps2", "ay_mps2", "az_mps2", "phi_rad", "theta_rad", "psi_rad",
    "elevator_rad", "aileron_rad", "rudder_rad", "throttle",
    "qbar_pa", "static_pa", "density_kgpm3", "altitude_m",
    "v_north_mps", "v_east_mps", "v_down_mps",
)  # fmt: skip
WANTED = frozenset(("t_s", *USED))
# Missing for longer, one of these makes a maneuver useless; others are only looked at.
FITTED = (
    "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps",
    "ax_mps2", "ay_mps2", "az_mps2", "phi_rad", "theta_rad",
    "elevator_rad", "aileron_rad", "rudder_rad",
)  # fmt: skip
BRIDGED = "bridged"  # column of the table: not zero where a line was drawn over a long gap
LONGEST_GAP_S = 0.25
FEWEST = 30  # 1.5 s at 20 Hz
SLOWEST_S, FASTEST_S = 0.5, 1e-4  # between rows: beyond, the unit of time is wrong
BACKWARD_S = 1.0  # rows may swap places; a step back over more is another recording
MOST_JUMP_RAD = 2.0 * np.pi + 0.5
FEW_ROWS = 500_000  # of an even grid: 80 minutes at 100 Hz, however few were recorded
MOST_EMPTY = 20  # rows of the even grid for each row that was recorded


def even_columns(table: pd.DataFrame) -> tuple[dict[str, Array], list[str]]:
    """Return the columns identification uses of a decoded table, on an even grid, and notes.

    Raises
    ------
    IdentificationError
        If there is no time in it, or too little of it.
    """
    return even_arrays(from_frame(table).columns)


def even_arrays(columns: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Return the same of columns that are arrays already.

    Raises
    ------
    IdentificationError
        If there is no time in them, or too little of it.
    """
    raw = {k: v for k, v in columns.items() if k in WANTED}
    if "t_s" not in raw:
        raise IdentificationError("no column t_s in the table")
    notes: list[str] = []
    return even_grid(raw, notes), notes


def rows_in_order(t: Array, notes: list[str]) -> IntArray:
    """Return which rows are used, in order of time.

    Raises
    ------
    IdentificationError
        If they are too few or from two recordings.
    """
    index = np.flatnonzero(np.isfinite(t))
    steps = np.diff(t[index])
    if len(index) < FEWEST:
        raise IdentificationError(f"{len(index)} samples with a time, at least {FEWEST} are needed")
    if steps.min() < -BACKWARD_S:
        k = int(np.argmin(steps))
        raise IdentificationError(
            f"time jumps back from {t[index[k]]:.6g} to {t[index[k + 1]]:.6g} s in row"
            f" {index[k + 1] + 1}: more than one recording; cut the file there"
        )
    if steps.min() > 0.0:
        return index
    swapped = int(np.sum(steps < 0.0))
    order = index[np.argsort(t[index], kind="stable")]
    kept: IntArray = order[np.concatenate([[True], np.diff(t[order]) > 0.0])]
    if len(kept) < FEWEST:
        raise IdentificationError(
            f"{len(kept)} different instants, at least {FEWEST} are needed: time stands still"
        )
    if swapped:
        notes.append(f"{swapped} rows came before their time and were sorted in")
    if len(kept) < len(index):
        few = ": t_s is written with too few digits" if len(kept) < 0.6 * len(index) else ""
        notes.append(
            f"{len(index) - len(kept)} of {len(index)} rows repeat an instant and were left out"
            + few
        )
    return kept


class _Instants:
    """The instants at which some column was measured; columns of one sensor share them."""

    def __init__(self, t: Array) -> None:
        self.t = t
        self.gaps = np.diff(t)
        usual_s = float(np.median(self.gaps)) if len(t) > 1 else 0.0
        self.step_s = usual_s if len(t) >= FEWEST else 0.0
        self.long_s = max(LONGEST_GAP_S, 3.0 * usual_s) if len(t) > 1 else 0.0


def _instants(t: Array, columns: Mapping[str, Array]) -> dict[str, _Instants]:
    """Return the instants of each column; medians over an hour are taken once a sensor."""
    by_pattern: dict[bytes, _Instants] = {}
    found: dict[str, _Instants] = {}
    for name, values in columns.items():
        seen = np.isfinite(values)
        pattern = np.packbits(seen).tobytes()
        if pattern not in by_pattern:
            by_pattern[pattern] = _Instants(t[seen])
        found[name] = by_pattern[pattern]
    return found


def _recorded_s(rows: _Instants) -> float:
    """Return the time of all rows without their gaps."""
    return float(np.sum(rows.gaps[rows.gaps <= rows.long_s]))  # a gap of all is nobody's


def _covered(own: _Instants, recorded_s: float) -> float:
    """Return the share of the time that the instants seen follow each other as they usually do."""
    if len(own.t) < FEWEST or own.long_s > max(LONGEST_GAP_S, 3.0 * SLOWEST_S):
        return 0.0
    return float(np.sum(own.gaps[own.gaps <= own.long_s])) / max(recorded_s, 1e-9)


def _grid(rows: _Instants, dt_s: float, notes: list[str]) -> Array:
    """Return even instants at the rate of the fastest sensor."""
    t, gaps = rows.t, rows.gaps
    if not FASTEST_S <= dt_s <= SLOWEST_S:
        raise IdentificationError(
            f"a row every {dt_s:.3g} s: {FASTEST_S:g} to {SLOWEST_S:g} s can be used; is the unit"
            " of t_s right?"
        )
    count = int((t[-1] - t[0]) / dt_s) + 1
    if count > max(MOST_EMPTY * len(t), FEW_ROWS):
        k = int(np.argmax(gaps))
        raise IdentificationError(
            f"time jumps from {t[k]:.6g} to {t[k + 1]:.6g} s: cut the file there"
        )
    if float(gaps.max()) > rows.long_s:
        many = int((gaps > rows.long_s).sum())
        notes.append(
            f"{many} gap{'s' if many > 1 else ''}, the longest {gaps.max():.2f} s;"
            " a maneuver over one is divided"
        )
    return np.asarray(t[0] + dt_s * np.arange(count))


def even_grid(
    columns: dict[str, Array], notes: list[str], fitted: Collection[str] = FITTED
) -> dict[str, Array]:
    """Bring the table to an even grid, unwrap angles once, draw curves between slow samples and
    lines over gaps.

    The table is emptied meanwhile: hours of a log are in memory once.
    """
    index = rows_in_order(columns["t_s"], notes)
    if not np.array_equal(index, np.arange(len(columns["t_s"]))):
        columns = {name: values[index] for name, values in columns.items()}
    instants = _instants(columns["t_s"], columns)
    rows = instants["t_s"]
    steps = {name: own.step_s for name, own in instants.items() if name in FITTED}
    dt_s = min((step for step in steps.values() if step > 0.0), default=rows.step_s)
    grid = _grid(rows, dt_s, notes)
    result: dict[str, Array] = {"t_s": grid}
    bridged, recorded_s = _over(grid, rows), _recorded_s(rows)
    longest_step_s = float(rows.gaps.max())
    missing: list[tuple[float, float, str]] = []
    slower: list[str] = []
    for name in [name for name in columns if name != "t_s"]:
        values, own = columns.pop(name), instants[name]
        covered = _covered(own, recorded_s)
        if covered < 0.5:
            notes.append(f"{name}: {100.0 * (1.0 - covered):.0f} % missing, not used")
            continue
        if steps.get(name, 0.0) > GAP_FACTOR * dt_s:
            slower.append(f"{name} {steps[name]:.3g} s")
        series = values[np.isfinite(values)]
        if name in ANGLES:
            series = _unwrapped(name, series, notes)
        result[name] = np.interp(grid, own.t, series)
        if own.step_s * 1e6 > SLOW_US and name in FITTED:
            result[name] += _bent(grid, own, series)
        if steps.get(name, 0.0) > GAP_FACTOR * dt_s:
            result[sampled_name(name)] = _at_instants(grid, own.t)
        if name in fitted and len(own.t) < len(rows.t):
            bridged |= _over(grid, own)
            longest = int(np.argmax(own.gaps))
            if own.gaps[longest] > max(own.long_s, 1.01 * longest_step_s):
                missing.append((float(own.gaps[longest]), float(own.t[longest]), name))
    if slower:
        notes.append(
            f"slower than the {dt_s:.3g} s of others, drawn between: {', '.join(slower)}; output"
            " and filter error compare at their own instants, all else takes what is drawn for"
            " measurements"
        )
    if missing:
        length_s, at_s, _ = max(missing)
        names = ", ".join(name for _, _, name in missing)
        notes.append(
            f"missing within the flight, for {length_s:.2f} s from {at_s:.2f} s: {names};"
            " a maneuver over a gap is divided"
        )
    if bridged.any():
        result[BRIDGED] = bridged.astype(np.float64)
    return result


def _bent(grid: Array, own: _Instants, series: Array) -> Array:
    """Return the difference of a curve through slow samples and the lines between them."""
    t = np.asarray(own.t, np.float64)
    index = np.clip(np.searchsorted(t, grid, side="right") - 1, 0, len(t) - 2)
    weight = np.clip((grid - t[index]) / own.gaps[index], 0.0, 1.0)
    more = bend(t, np.asarray(series, np.float64), index, weight)
    return np.where(own.gaps[index] < GAP_FACTOR * own.step_s, more, 0.0)


def _unwrapped(name: str, series: Array, notes: list[str]) -> Array:
    """Return an angle without its jumps by a turn: of 360 where it is in degrees."""
    largest = float(np.max(np.abs(np.diff(series)), initial=0.0))
    if largest < np.pi:
        return series  # nothing to unwrap; np.unwrap of an hour costs more than the interpolation
    if largest <= MOST_JUMP_RAD:
        return np.asarray(np.unwrap(series))
    notes.append(f"{name} jumps by {largest:.3g} rad from one row to the next: turns of 360 there")
    return np.asarray(np.unwrap(series, period=360.0))


def _at_instants(grid: Array, t: Array) -> Array:
    """Return one at the grid's instants that are nearest to some of t, zero at all others."""
    found = np.zeros(len(grid))
    step_s = float(grid[1] - grid[0])
    nearest = np.clip(np.round((t - grid[0]) / step_s), 0, len(grid) - 1).astype(np.int64)
    found[nearest] = 1.0
    return found


def _over(grid: Array, own: _Instants) -> BoolArray:
    """Return where the grid lies within a long gap between instants."""
    t, long_s = own.t, own.long_s
    over = np.zeros(len(grid), dtype=bool)
    for last in np.flatnonzero(own.gaps > long_s):
        over[np.searchsorted(grid, t[last], "right") : np.searchsorted(grid, t[last + 1])] = True
    if t[0] - grid[0] > long_s:
        over[: np.searchsorted(grid, t[0])] = True
    if grid[-1] - t[-1] > long_s:
        over[np.searchsorted(grid, t[-1], "right") :] = True
    return over
