"""Inputs that the logger flew itself, as columns next to those it measured.

Nothing need be found where the log says it: the finder takes start, end and surfaces from here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array

if TYPE_CHECKING:
    from host.log.flown_inputs import FlownInput
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver

# On the rows while an input runs; 0 elsewhere: no input starts with its log.
START, END, SHAPE, AXES = "input_start_s", "input_end_s", "input_shape", "input_axes"
TRIGGER, HELD = "input_trigger_s", "input_held"
SURFACES = ("aileron", "elevator", "rudder")
KINDS = ("multistep", "pulse", "doublet", "3-2-1-1", "sweep", "multisine")  # by card_shape
SHAPES = ("unknown", "pulse", "doublet", "three_two_one_one", "sweep", "multisine")
MOVED = 0.5  # share of the largest swing: surfaces of a row that the log lost


def input_columns(t_s: Array, inputs: Sequence[FlownInput]) -> dict[str, Array]:
    """Return the inputs that the logger flew, on the rows of a table; empty if none.

    Parameters
    ----------
    t_s : (n,) array
    inputs : sequence of FlownInput
    """
    if not inputs:
        return {}
    names = (START, END, SHAPE, AXES, TRIGGER, HELD)
    columns: dict[str, Array] = {name: np.zeros(len(t_s)) for name in names}
    for one in inputs:
        first, last = np.searchsorted(t_s, (one.start_s, one.end_s))
        rows = slice(int(first), max(int(last), int(first) + 1))
        moved, held = (
            sum(1 << k for k, name in enumerate(SURFACES) if name in among)
            for among in (one.axes, one.held)
        )
        shape = SHAPES.index(one.shape) if one.shape in SHAPES else 0
        values = (one.start_s, one.end_s, shape, moved, one.triggered_s, held)
        for name, value in zip(names, values, strict=True):
            columns[name][rows] = value
    return columns


def logged_inputs(
    columns: Mapping[str, Array], surfaces: Mapping[str, Array]
) -> dict[tuple[str, float, float], tuple[str, float]]:
    """Return kind and amplitude of each input by surface, start and end.

    Parameters
    ----------
    columns : mapping
        With those of `input_columns`, or without.
    surfaces : mapping
        Positions, by column, rad.
    """
    if START not in columns:
        return {}
    starts = np.asarray(columns[START])
    found: dict[tuple[str, float, float], tuple[str, float]] = {}
    for start_s in np.unique(starts[starts > 0.0]).tolist():
        rows = np.flatnonzero(starts == start_s)
        first = int(rows[0])
        end_s, shape, bits = (float(columns[name][first]) for name in (END, SHAPE, AXES))
        swings = {
            name: float(np.max(np.abs(series[rows] - series[max(first - 1, 0)])))
            for name, series in surfaces.items()
            if name != "throttle"
        }
        named = [f"{s}_rad" for k, s in enumerate(SURFACES) if int(bits) >> k & 1]
        largest = max(swings.values(), default=0.0)
        moved = [n for n in named if n in swings] or [
            n for n, size in swings.items() if size > MOVED * largest
        ]
        for name in moved:
            found[name, start_s, end_s] = (KINDS[int(shape)], swings[name])
    return found


def without_held(
    columns: Mapping[str, Array], found: Sequence[DetectedManeuver]
) -> list[DetectedManeuver]:
    """Return what no row held: from its trigger on a held surface moves by feedback.

    Parameters
    ----------
    columns : mapping
        With those of `input_columns`.
    found : sequence of DetectedManeuver
    """
    ends = np.asarray(columns[END])
    spans: set[tuple[str, float, float]] = set()
    for end_s in np.unique(ends[ends > 0.0]).tolist():
        first = int(np.argmax(ends == end_s))
        bits, begin_s = int(columns[HELD][first]), float(columns[TRIGGER][first])
        spans |= {(f"{s}_rad", begin_s, end_s) for k, s in enumerate(SURFACES) if bits >> k & 1}
    return [
        item
        for item in found
        if not any(
            item.axis == axis and item.start_s < end_s and item.input_end_s > begin_s
            for axis, begin_s, end_s in spans
        )
    ]
