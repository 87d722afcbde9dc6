"""Which values of a foreign column are measurements: no spikes, no repeats, no dropouts.

A logger that writes every sensor in every row repeats the last value of a slow one: late by half
its period on average. One that fills what is missing writes zero, the last value or -9999.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.sysid.flight.maneuver_detection import FLYING_SHARE

FAR = 100.0  # of the range that 96 % of the values lie in
FEW = 0.02  # of all values: more are no spikes
FEWEST = 32
REGULAR, EVEN = 0.7, 0.2  # of the runs are as long as the median, to this share of it


def measured(
    columns: Mapping[str, Array], names: Sequence[str], longest_s: float
) -> tuple[dict[str, Array], list[str]]:
    """Return the columns with what was not measured as missing, and notes about it.

    Parameters
    ----------
    columns : mapping
        `t_s`, in order of time, and the columns.
    names : sequence of str
        Sensors to look at.
    longest_s : float
        A sensor that stands still for longer, alone, has dropped out.
    """
    t = columns["t_s"]
    result, notes = dict(columns), []
    sensors = [name for name in names if name in columns]
    for name in sensors:
        values = result[name].copy()
        notes += [f"{name}: {note}" for note in _spikes(t, values)]
        result[name] = values
    held = {}
    for name in sensors:
        period = _period(result[name])
        if period:
            held[name] = period
    flying = _airborne(columns, len(t))  # at rest on the ground anything may stand still
    moving = np.zeros(len(t), dtype=np.int64)
    for name in sensors:
        moving[1:] += np.diff(result[name]) != 0.0
    for name in sensors:
        values = result[name].copy()
        starts, lengths = _runs(values)
        inside = (starts >= flying.start) & (starts + lengths <= flying.stop)
        if name in held:
            first = np.zeros(len(t), dtype=bool)
            first[starts] = True
            values[~first] = np.nan
        elif len(lengths) and np.median(lengths) == 1:
            dropout_notes = _stuck(t, values, starts[inside], lengths[inside], moving, longest_s)
            notes += [f"{name}: {note}" for note in dropout_notes]
        result[name] = values
    if held:
        rates = ", ".join(f"{name} every {rows} rows" for name, rows in held.items())
        notes.append(f"a slower sensor's last value repeated, read where it changes: {rates}")
    return result, notes


def _airborne(columns: Mapping[str, Array], rows: int) -> slice:
    """Return from the first to the last row of flight."""
    if "airspeed_mps" not in columns:
        return slice(0, rows)
    speed = np.nan_to_num(columns["airspeed_mps"])
    flown = np.flatnonzero(speed > FLYING_SHARE * float(np.median(speed)))
    return slice(int(flown[0]), int(flown[-1]) + 1) if len(flown) else slice(0, rows)


def _spikes(t: Array, values: Array) -> list[str]:
    seen = np.isfinite(values)
    if seen.sum() < FEWEST:
        return []
    low, middle, high = np.quantile(values[seen], (0.02, 0.5, 0.98))
    far = np.flatnonzero(seen & (np.abs(values - middle) > FAR * (high - low)))
    if not 0 < len(far) < FEW * seen.sum() or high <= low:
        return []
    note = (
        f"{len(far)} value{'s' if len(far) > 1 else ''} far out of all others count as missing"
        f" (the first is {values[far[0]]:.4g} at {t[far[0]]:.6g} s)"
    )
    values[far] = np.nan
    return [note]


def _runs(values: Array) -> tuple[IntArray, IntArray]:
    """Return where equal values begin, and how many of them follow each other."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0]))
    return starts, np.diff(np.append(starts, len(values)))


def _period(values: Array) -> int:
    """Return how many rows each value stays; 0 unless it is regular."""
    if not np.isfinite(values).all():
        return 0
    lengths = _runs(values)[1][1:-1]  # ends are cut
    if len(lengths) < FEWEST:
        return 0
    usual = float(np.median(lengths))
    regular = float(np.mean(np.abs(lengths - usual) <= EVEN * usual)) >= REGULAR
    return round(usual) if usual >= 2.0 and regular else 0


def _stuck(
    t: Array, values: Array, starts: IntArray, lengths: IntArray, moving: IntArray, longest_s: float
) -> list[str]:
    """Take out where a sensor stands still for long while others move."""
    notes = []
    ends = starts + lengths - 1
    long = (t[ends] - t[starts] > longest_s) & np.isfinite(values[starts])
    for start, last in zip(starts[long], ends[long], strict=True):
        alone: BoolArray = moving[start + 1 : last + 1] > 0
        if alone.mean() > 0.5:
            notes.append(
                f"stands still at {values[start]:.4g} for {t[last] - t[start]:.2f} s from"
                f" {t[start]:.6g} s while others move: counts as missing"
            )
            values[start : last + 1] = np.nan
    if len(notes) > 1:
        return [f"{notes[0]}; and {len(notes) - 1} times more"]
    return notes
