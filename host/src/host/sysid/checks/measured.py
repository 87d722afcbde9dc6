"""Which values of a foreign column are measurements: no spikes, no repeats, no dropouts.

A logger that writes every sensor in every row repeats the last value of a slow one: late by half
its period on average. One that fills what is missing writes zero, the last value or -9999.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.people_units import people_name
from host.readers.column_sampling import FEWEST, Sampling, sampling_of
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.stuck_sensors import stuck_runs
from host.sysid.maneuvers.maneuver_detection import FLYING_SHARE

SPIKE_RANGES = 100.0  # beyond the middle: of the range that 96 % of the values lie in
SPIKE_SHARE = 0.02  # of all values: more are no spikes
LONGEST_HOLDS = 3.0  # a held sensor may stand still for as many of its periods


@dataclass(frozen=True, slots=True)
class Measured:
    """Columns with what was not measured as missing, notes and findings about it, and how each
    sensor was sampled."""

    columns: dict[str, Array]
    notes: list[str]
    findings: list[Finding]
    sampling: dict[str, Sampling]


def measured(
    columns: Mapping[str, Array],
    names: Sequence[str],
    longest_s: float,
    accept: Collection[str] = (),
) -> Measured:
    """Return the columns with what was not measured as missing.

    Parameters
    ----------
    columns : mapping
        `t_s`, in order of time, and the columns.
    names : sequence of str
        Sensors to look at.
    longest_s : float
        A sensor that must move and stands still for longer is stuck.
    accept : collection of str
        Checks whose findings change nothing.
    """
    t = columns["t_s"]
    raw, notes = dict(columns), []
    sensors = [name for name in names if name in columns]
    for name in sensors:
        raw[name], said = _without_spikes(t, raw[name])
        notes += [f"{name}: {note}" for note in said]
    sampling = {name: sampling_of(raw[name]) for name in sensors}
    held = {name: s.hold for name, s in sampling.items() if s.hold > 1}
    if held:
        rates = ", ".join(f"{name} every {rows} rows" for name, rows in held.items())
        notes.append(f"a slower sensor's last value repeated, read where it was sampled: {rates}")
    result, findings = _without_stuck(raw, sampling, longest_s, accept)
    return Measured(result, notes, findings, sampling)


def _without_stuck(
    raw: Mapping[str, Array],
    sampling: Mapping[str, Sampling],
    longest_s: float,
    accept: Collection[str],
) -> tuple[dict[str, Array], list[Finding]]:
    """Return the columns, missing where a sensor repeats itself or is stuck, and findings."""
    t, sensors = raw["t_s"], list(sampling)
    usual_s = float(np.median(np.diff(t)))
    result, findings = dict(raw), []
    flying = _airborne(raw, len(t))  # at rest on the ground anything may stand still
    look = {k: raw[k][flying] for k in ("t_s", *sensors)}
    for name in sensors:
        own = sampling[name]
        values = raw[name] if own.sampled.all() else np.where(own.sampled, raw[name], np.nan)
        still_s = max(longest_s, LONGEST_HOLDS * own.hold * usual_s)
        stuck = stuck_runs(look, name, own.step, still_s)
        if stuck:
            found = _stuck_finding(look, name, stuck).accepted_if(accept)
            findings.append(found)
            values = values.copy()
            for first, end in () if found.accepted else stuck:
                values[flying.start + first : flying.start + end] = np.nan
        result[name] = values
    return result, findings


def _airborne(columns: Mapping[str, Array], rows: int) -> slice:
    """Return from the first to the last row of flight."""
    if "airspeed_mps" not in columns:
        return slice(0, rows)
    speed = np.nan_to_num(columns["airspeed_mps"])
    flown = np.flatnonzero(speed > FLYING_SHARE * float(np.median(speed)))
    return slice(int(flown[0]), int(flown[-1]) + 1) if len(flown) else slice(0, rows)


def _without_spikes(t: Array, values: Array) -> tuple[Array, list[str]]:
    """Return a column, what is far out of it missing, and a note on that."""
    seen = np.isfinite(values)
    if seen.sum() < FEWEST:
        return values, []
    low, middle, high = np.quantile(values[seen], (SPIKE_SHARE, 0.5, 1.0 - SPIKE_SHARE))
    far = np.flatnonzero(seen & (np.abs(values - middle) > SPIKE_RANGES * (high - low)))
    if not 0 < len(far) < SPIKE_SHARE * seen.sum() or high <= low:
        return values, []
    note = (
        f"{len(far)} value{'s' if len(far) > 1 else ''} far out of all others count as missing"
        f" (the first is {values[far[0]]:.4g} at {t[far[0]]:.6g} s)"
    )
    kept = values.copy()
    kept[far] = np.nan
    return kept, [note]


def _stuck_finding(
    columns: Mapping[str, Array], name: str, stuck: Sequence[tuple[int, int]]
) -> Finding:
    t, (first, end) = columns["t_s"], stuck[0]
    more = f", and {len(stuck) - 1} times more" if len(stuck) > 1 else ""
    return Finding(
        "stuck-sensor",
        (name,),
        f"{name} stands still at {_level(name, columns[name][first])} for"
        f" {t[end - 1] - t[first]:.2f} s from"
        f" {t[first]:.6g} s while it must move{more}",
        ("a dropout that the logger filled", "a sensor that sticks"),
        "counts as missing there; maneuvers over it are left out",
        closed=True,
    )


def _level(name: str, value: float) -> str:
    """Return a value as a person reads it: angles in degrees."""
    called, scale = people_name(name)
    unit = {"deg": " deg", "degps": " deg/s"}.get(called.rpartition("_")[2], "")
    return f"{scale * value:.4g}{unit}"
