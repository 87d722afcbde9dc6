"""Fleets as tables and pictures: intervals by size of fleet, and the power curve of changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies import fleet_changes, fleet_truth
from studies.study_table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Rows = list[tuple[str | int | float, ...]]


def truth_rows(fleets: int) -> Rows:
    """Return a row a cell: shares that hold, and how often a spread of zero is seen to be one."""
    found: Rows = []
    seeds = range(fleet_truth.FIRST_SEED, fleet_truth.FIRST_SEED + fleets)
    for cell in fleet_truth.cells():
        fleet_rows = [fleet_truth.row_of(cell, seed, oracle=False) for seed in seeds]
        held = [
            100.0 * float(np.mean([int(str(r[f"{q}_holds"])) for r in fleet_rows]))
            for q in fleet_truth.QUANTITIES
        ]
        zero = [float(str(r["between_lower"])) == 0.0 for r in fleet_rows]
        found.append((cell.name, fleets, *held, 100.0 * float(np.mean(zero))))
    return found


def truth_table(rows: Rows) -> Table:
    """Return the table of intervals."""
    columns = ("aircraft x flights, ratio", "fleets", "mean holds, %", "between aircraft holds, %",
               "between flights holds, %", "lower end of the former is 0, %")  # fmt: skip
    return Table("Fleets drawn at the level of estimates", columns, tuple(rows))


def truth_figure(rows: Rows) -> Figure:
    """Return the shares that hold over the cells."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.0))
    axes = figure.subplots()
    for k, name in enumerate(fleet_truth.QUANTITIES):
        axes.plot([float(r[2 + k]) for r in rows], "os^"[k], label=name, ms=4)
    axes.axhspan(92.0, 98.0, color="#e5e7eb", zorder=0)
    axes.set(ylabel="intervals that hold, %", ylim=(min(80.0, axes.get_ylim()[0]), 101.0))
    axes.set_xticks(range(len(rows)), [str(r[0]) for r in rows], rotation=90, fontsize=6)
    axes.legend(fontsize=8)
    return figure


def change_rows(aircraft: int) -> Rows:
    """Return a row a cause: share of alarms within three flights by the size of the shift, and how
    often the cause was named first at the shift that is asked for."""
    found: Rows = []
    for pots in (True, False):
        kind = fleet_changes.Watched(pots)
        fleets = fleet_changes.unchanged(kind, aircraft, fleet_changes.FIRST_SEED)
        for cause in kind.patterns():
            each = [
                fleet_changes.power(kind, fleets, cause, s, fleet_changes.FIRST_SEED + 20 + k)
                for k, s in enumerate(fleet_changes.SHIFTS)
            ]
            named = each[fleet_changes.SHIFTS.index(fleet_changes.ASKED)].named
            found.append((
                f"{cause}, {'pots' if pots else 'commands'}",
                *(100.0 * f.alarmed for f in each),
                100.0 * named,
            ))  # fmt: skip
    return found


def change_table(rows: Rows) -> Table:
    """Return the table of changes."""
    shifts = (f"alarm at {s:g} sd, %" for s in fleet_changes.SHIFTS)
    columns = ("cause", *shifts, f"named first at {fleet_changes.ASKED:g} sd, %")
    return Table("Changed aircraft, alarm within three flights", columns, tuple(rows))


def change_figure(rows: Rows) -> Figure:
    """Return the power curve of every cause."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.5))
    axes = figure.subplots()
    for row in rows:
        style = "-" if str(row[0]).endswith("pots") else "--"
        shares: Sequence[float] = [float(x) for x in row[1:-1]]
        axes.plot(fleet_changes.SHIFTS, shares, style, lw=1, label=str(row[0]))
    axes.axvline(fleet_changes.ASKED, color="#6b7280", lw=1)
    axes.axhline(90.0, color="#6b7280", lw=1)
    axes.set(
        xlabel="shift, standard deviations of one flight's estimate",
        ylabel="alarm within three flights, %",
    )
    axes.legend(fontsize=5, ncols=2)
    return figure
