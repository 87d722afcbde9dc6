"""How a source was recorded: which surfaces are commands, and who checked its clock.

A log says so itself. A table that `host decode` wrote shows it: a surface is measured where its
column is that of its pots, or what somebody made of them since, which is more like them than like
the command; and the clock is checked where GPS spoke for long enough. Nothing is known of a table
of others: its surfaces count as measured, unless its map calls them commands, and its clock as
right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.physical.recording import FOREIGN, SURFACES, Recording
from host.physical.timebase import MIN_SPAN_S

if TYPE_CHECKING:
    from host.log import FlightLog
    from host.readers.column_map import Line

OWN_COLUMN = "mega_drives"  # no table of others has this column
GPS_COLUMN = "v_north_mps"
SAME_ANGLE_RAD = 2e-6  # a table of text has six decimals, each pot and the mean rounded
MATCHING_SHARE = 0.5  # of the samples


def recording_of_log(log: FlightLog) -> Recording:
    """Return how a log was recorded."""
    commanded = tuple(s for s in SURFACES if log.inputs.get(s) == "commanded")
    half = log.clock_half_width
    return Recording(commanded, None if half is None else half / NORMAL_95)


def recording_of_table(columns: Mapping[str, Array], said: Mapping[Any, Any]) -> Recording:
    """Return how a table was recorded; `said` are the notes of `FlightLog.table`, or empty."""
    if "inputs" in said and "clock_half_width" in said:
        half, inputs = said["clock_half_width"], said["inputs"]
        commanded = tuple(s for s in SURFACES if inputs.get(s) == "commanded")
        return Recording(commanded, None if half is None else float(half) / NORMAL_95)
    if OWN_COLUMN not in columns:
        return Recording(maker=FOREIGN)
    commanded = tuple(s for s in SURFACES if f"{s}_rad" in columns and not _measured(columns, s))
    fix_times_s = (
        columns["t_s"][np.isfinite(columns[GPS_COLUMN])] if GPS_COLUMN in columns else np.empty(0)
    )
    checked = len(fix_times_s) > 0 and float(np.ptp(fix_times_s)) >= MIN_SPAN_S
    return Recording(commanded, 0.0 if checked else None)


def commanded_by_map(recording: Recording, lines: Mapping[str, Line]) -> Recording:
    """Return a recording with the surfaces that a map names: commands where it says so."""
    said = {s: lines[f"{s}_rad"].commanded for s in SURFACES if f"{s}_rad" in lines}
    every = tuple(s for s in SURFACES if said.get(s, s in recording.commanded))
    return replace(recording, commanded=every)


def _measured(columns: Mapping[str, Array], surface: str) -> bool:
    """Return whether a surface's column is what its pots said, as it was or worked on since."""
    pot, values = _pot(columns, surface), columns[f"{surface}_rad"]
    if pot is None:
        return False
    seen = np.isfinite(values)
    if np.sum((np.abs(values - pot) < SAME_ANGLE_RAD) & seen) >= MATCHING_SHARE * np.sum(seen):
        return True
    command = _command(columns, surface)
    return command is not None and _unlike(values, pot) < _unlike(values, command)


def _pot(columns: Mapping[str, Array], surface: str) -> Array | None:
    """Return what the pots of a surface said, rad; None where one is missing."""
    if surface == "aileron":
        pots = [columns.get(f"aileron_{side}_rad") for side in ("left", "right")]
    else:
        pots = [columns.get(f"{surface}_pot_rad")]
    known = [pot for pot in pots if pot is not None]
    if len(known) < len(pots):
        return None
    return known[0] if len(known) == 1 else 0.5 * (known[0] - known[1])


def _command(columns: Mapping[str, Array], surface: str) -> Array | None:
    """Return the command of a surface, of a virtual flight rad, of a log its pulse, us."""
    command, sent, received = f"{surface}_command_rad", f"servo_{surface}_us", f"rc_{surface}_us"
    if command in columns:
        return columns[command]
    if sent not in columns or received not in columns:
        return None
    return np.where(columns[OWN_COLUMN] > 0.0, columns[sent], columns[received])


def _unlike(values: Array, other: Array) -> float:
    """Return the share of the motion of a column that no line through another explains."""
    both = np.isfinite(values) & np.isfinite(other)
    if np.sum(both) < MATCHING_SHARE * np.sum(np.isfinite(values)) or np.ptp(other[both]) == 0.0:
        return np.inf
    correlation = np.corrcoef(values[both], other[both])[0, 1]
    return float(1.0 - correlation**2)
