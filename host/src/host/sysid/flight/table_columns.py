"""Columns of other people's tables: timed, what was not measured left out, units checked."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from host.arrays import Array
from host.readers.column_sampling import Sampling
from host.readers.even_grid import FITTED, LONGEST_GAP_S, even_grid, rows_in_order
from host.readers.flight_choice import file_and_flight
from host.readers.foreign_tables import Foreign
from host.readers.table_clock import counted_on, evenly_timed, one_recording
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.finding_consequences import checked
from host.sysid.checks.measured import Measured, measured
from host.sysid.checks.unit_sign_checks import SURFACES

AIR = ("density_kgpm3", "altitude_m", "static_pa")  # any of them tells the density
SENSORS = tuple(name for name in FITTED if name not in SURFACES)  # a command may well stand still


def table_columns(
    used: dict[str, Array],
    found: Foreign,
    source: Any,
    called: str,
    accept: Collection[str],
    equations: Collection[str] = (),
) -> tuple[dict[str, Array], list[Finding], dict[str, float]]:
    """Return columns on an even grid, findings, and the step of each quantised column.

    Parameters
    ----------
    used : dict of Array
        Columns by our names, as they were read; emptied.
    found : Foreign
        What was read; what is done is noted in it.
    source : Path or DataFrame
    called : str
        Where it was read from.
    accept : collection of str
        Checks whose findings change nothing.
    equations : collection of str
        Columns that a model reads; empty: it may be any.
    """
    timing: list[Finding] = []
    if not set(AIR) & used.keys():
        found.notes.append(
            "density is not known, for density_kgpm3, altitude_m and static_pa are missing:"
            " coefficients take that of sea level"
        )
    if not found.shares:  # a table: an autopilot's log is read clock by clock
        used = _timed(used, source, called, found.notes, timing, accept)
    fitted = [name for name in FITTED if not equations or name in equations]
    seen = _measured(used, found.notes, accept, fitted)
    used.clear()
    even = even_grid(seen.columns, found.notes, fitted)
    columns, findings = checked(even, accept)
    slow = _slow_outputs(found.slow_outputs)
    resolution = _resolutions(seen.sampling, even, columns)
    return columns, [*timing, *slow, *seen.findings, *findings], resolution


def _timed(
    columns: dict[str, Array],
    source: Any,
    called: str,
    notes: list[str],
    findings: list[Finding],
    accept: Collection[str],
) -> dict[str, Array]:
    """Return the rows of one recording with times that go on, and a finding where they were made
    even."""
    flight = file_and_flight(source)[1] if isinstance(source, Path) else None
    columns = columns | {"t_s": counted_on(columns["t_s"], notes)}
    columns = one_recording(columns, flight, called, notes)
    even = evenly_timed(columns)
    if even is None:
        return columns
    t_s, digit_s = even
    rate_hz = 1.0 / float(t_s[1] - t_s[0])
    found = Finding(
        "time-digits",
        (),
        f"t_s has digits of {digit_s:.3g} s where rows come at {rate_hz:.4g} Hz",
        ("a time that was written with too few digits",),
        done="rows are timed evenly, which agrees with every digit",
    ).accepted_if(accept)
    findings.append(found)
    return columns if found.accepted else columns | {"t_s": t_s}


def _measured(
    columns: dict[str, Array], notes: list[str], accept: Collection[str], fitted: Collection[str]
) -> Measured:
    """Return the rows that are used, in order, what was not measured as missing, and findings."""
    index = rows_in_order(columns["t_s"], notes)
    sensors = [name for name in SENSORS if name in fitted]
    if len(index) < len(columns["t_s"]) or np.any(np.diff(index) != 1):
        columns = {k: v[index] for k, v in columns.items()}
    found = measured(columns, sensors, LONGEST_GAP_S, accept)
    notes += found.notes
    return found


def _slow_outputs(rates_hz: Mapping[str, float]) -> list[Finding]:
    """Return a finding where a surface may have moved between two records of its output."""
    if not rates_hz:
        return []
    rates = ", ".join(f"{name} {rate:.0f} Hz" for name, rate in rates_hz.items())
    return [
        Finding(
            "surface-rate",
            tuple(f"{name}_rad" for name in rates_hz),
            f"outputs are logged more slowly than servos get them ({rates}): when a surface moved"
            " is known to a part of a step only",
            ("a logging profile that writes outputs rarely", "a log received by radio"),
            done="what lies between two records is drawn on a curve through four",
        )
    ]


def _resolutions(
    sampling: Mapping[str, Sampling], even: Mapping[str, Array], used: Mapping[str, Array]
) -> dict[str, float]:
    """Return the step of each quantised column, in the unit in which the column is used."""
    found = {}
    for name, own in sampling.items():
        if own.step > 0.0 and name in used:
            span = float(np.ptp(even[name]))
            found[name] = own.step * float(np.ptp(used[name])) / span if span else own.step
    return found
