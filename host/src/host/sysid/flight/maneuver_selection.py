"""Which part of a flight the user asked for: maneuvers by number, or a stretch of time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.flight.maneuver_detection import AXES, DetectedManeuver, detect_maneuvers
from host.sysid.identification_error import IdentificationError

SURFACES = ("elevator_rad", "aileron_rad", "rudder_rad")
FEWEST = 8  # samples, as a maneuver needs
SHARED_S = 0.1  # windows that overlap by more are one
STILL_RAD = 1e-3  # a surface that moves less excites nothing: the pots resolve as much


def select_maneuvers(
    columns: Mapping[str, Array],
    *,
    from_s: float | None = None,
    to_s: float | None = None,
    numbers: Sequence[int] = (),
) -> list[DetectedManeuver]:
    """Return the maneuvers the user asked for; all that are found where nothing was asked.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    from_s, to_s : float, optional
        A stretch in the time of the table: one maneuver on each surface that leads in it.
    numbers : sequence of int
        Numbers as `host maneuvers` counts them, from 1; one named twice counts once.

    Raises
    ------
    IdentificationError
        If there is no such maneuver, or the stretch holds nothing to fit.
    """
    if from_s is None and to_s is None:
        return _numbered(columns, numbers) if numbers else detect_maneuvers(columns)
    if numbers:
        raise IdentificationError(
            "argument maneuvers excludes argument from_s and argument to_s: give one of them"
        )
    return _stretch(columns, from_s, to_s)


def _numbered(columns: Mapping[str, Array], numbers: Sequence[int]) -> list[DetectedManeuver]:
    found = detect_maneuvers(columns)
    wrong = [n for n in numbers if not 1 <= n <= len(found)]
    if wrong:
        there = f"there are {len(found)}" if found else "none was found"
        raise IdentificationError(f"no maneuver {wrong[0]}: {there} (`host maneuvers` lists them)")
    return [found[n - 1] for n in sorted(set(numbers))]


def _stretch(
    columns: Mapping[str, Array], from_s: float | None, to_s: float | None
) -> list[DetectedManeuver]:
    t = columns["t_s"]
    first = float(t[0]) if from_s is None else from_s
    last = float(t[-1]) if to_s is None else to_s
    asked = f"argument from_s {first:g}, argument to_s {last:g}"
    if not first < last:
        raise IdentificationError(f"{asked}: the start is not before the end")
    first, last = max(first, float(t[0])), min(last, float(t[-1]))
    inside = (t >= first) & (t <= last)
    if inside.sum() < FEWEST:
        raise IdentificationError(
            f"{asked}: {inside.sum()} samples, at least {FEWEST} are needed; the data run from"
            f" {t[0]:.6g} to {t[-1]:.6g} s"
        )
    holes = t[inside & (columns.get("bridged", np.zeros(len(t))) > 0.0)]
    if len(holes):
        raise IdentificationError(
            f"{asked}: the data have a gap there, at {holes[0]:.6g} s; choose a stretch without"
        )
    swing = {axis: float(np.ptp(columns[axis][inside])) for axis in SURFACES if axis in columns}
    if not swing:
        raise IdentificationError(f"{asked}: the data have none of {', '.join(SURFACES)}")
    if max(swing.values()) < STILL_RAD:
        raise IdentificationError(
            f"{asked}: no surface moved there; `host maneuvers` lists where one did"
        )
    return [
        DetectedManeuver(axis, "window", first + 0.3, last, last, size / 2.0, 0)
        for axis, size in swing.items()
        if size > 0.5 * max(swing.values())
    ]


def merge_overlapping(found: Sequence[DetectedManeuver]) -> list[DetectedManeuver]:
    """Join windows that share samples: surfaces that moved together are one record."""
    joined: list[DetectedManeuver] = []
    for item in sorted(found, key=lambda f: f.start_s):
        before = joined[-1] if joined else None
        if before is not None and item.start_s < before.end_s - SHARED_S:
            last_s = max(before.end_s, item.end_s)
            input_s = max(before.input_end_s, item.input_end_s)
            joined[-1] = replace(before, input_end_s=input_s, end_s=last_s)
        else:
            joined.append(item)
    return joined


def excited_axes(inputs: Sequence[str]) -> tuple[str, ...]:
    """Return on which axes to look for maneuvers of a model: its inputs, or all that they name.

    `elevator_pot_rad` moves with the elevator; of `gust_mps` nobody knows when it moved.
    """
    axes = [a for a in AXES if any(name.split("_")[0] == a.split("_")[0] for name in inputs)]
    return tuple(axes) or AXES
