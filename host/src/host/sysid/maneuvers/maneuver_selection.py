"""Which part of a flight the user asked for: maneuvers by number, or stretches of time."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.sysid.maneuvers.maneuver_detection import (
    AXES,
    FEWEST,
    LEAD_S,
    DetectedManeuver,
    detect_maneuvers,
    runs_of,
)

SURFACES = ("elevator_rad", "aileron_rad", "rudder_rad")
SHORTEST_STRETCH_S = 0.9  # two short periods of a trainer; 0.35 s put two derivatives under "trust"
MOVED_SHARE = 0.1  # of the motion in a stretch: a part with less of it is at rest
TOUCHING_S = 0.1  # windows as far apart, or on each other, only touch
HELD_OUT_FROM = 3  # maneuvers of an axis, of which one is held out
TimeSpan = tuple[float | None, float | None]  # from and to, s; None is the end of the record


def select_maneuvers(
    columns: Mapping[str, Array],
    *,
    stretches: Sequence[TimeSpan] = (),
    numbers: Sequence[int] = (),
) -> list[DetectedManeuver]:
    """Return the maneuvers the user asked for; all that are found where nothing was asked.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    stretches : sequence of (from, to)
        In the time of the table, s: each is a maneuver, whatever moved in it. A gap of the data
        divides it.
    numbers : sequence of int
        Numbers as `host maneuvers` counts them, from 1; one named twice counts once.

    Raises
    ------
    IdentificationError
        If there is no such maneuver, or a stretch holds too few samples.
    """
    if not stretches:
        return _numbered(columns, numbers) if numbers else detect_maneuvers(columns)
    if numbers:
        raise IdentificationError(
            "argument maneuvers excludes argument from_s and argument to_s: give one of them"
        )
    return [item for span in stretches for item in _span_maneuvers(columns, span)]


def _numbered(columns: Mapping[str, Array], numbers: Sequence[int]) -> list[DetectedManeuver]:
    found = detect_maneuvers(columns)
    wrong = [n for n in numbers if not 1 <= n <= len(found)]
    if wrong:
        there = f"there are {len(found)}" if found else "none was found"
        raise IdentificationError(f"no maneuver {wrong[0]}: {there} (`host maneuvers` lists them)")
    return [found[n - 1] for n in sorted(set(numbers))]


def _span_maneuvers(columns: Mapping[str, Array], span: TimeSpan) -> list[DetectedManeuver]:
    """Return each part of a stretch between gaps, once for every surface that leads in it."""
    t = columns["t_s"]
    first = float(t[0]) if span[0] is None else span[0]
    last = float(t[-1]) if span[1] is None else span[1]
    asked = f"stretch (argument from_s {first:g}, argument to_s {last:g})"
    if not first < last:
        raise IdentificationError(f"{asked}: the start is not before the end")
    inside = (t >= first) & (t <= last)
    if inside.sum() < FEWEST:
        raise IdentificationError(
            f"{asked}: {inside.sum()} samples, at least {FEWEST} are needed; the data run from"
            f" {t[0]:.6g} to {t[-1]:.6g} s"
        )
    measured = inside & ~(columns.get("bridged", np.zeros(len(t))) > 0.0)
    if not measured.any():
        raise IdentificationError(f"{asked}: the data have nothing but gaps there")
    length_s = float(np.median(np.diff(t))) * int(measured.sum())
    parts = [part for part in runs_of(measured) if _fitted(t[part]) >= FEWEST]
    if length_s < SHORTEST_STRETCH_S or not parts:
        raise IdentificationError(
            f"{asked}: {length_s:.2g} s of data, at least {SHORTEST_STRETCH_S:g} s are needed"
            + (", in longer pieces" if length_s >= SHORTEST_STRETCH_S else "")
        )
    leading = _leading(columns, np.concatenate(parts))
    return [item for part in parts for item in _given(columns, part, leading)]


def overlap_notes(stretches: Sequence[TimeSpan]) -> list[str]:
    """Return a note where stretches of one record share samples: those count once."""
    spans = sorted(
        (-np.inf if first is None else first, np.inf if last is None else last)
        for first, last in stretches
    )
    shared = [b for a, b in itertools.pairwise(spans) if b[0] < a[1] - TOUCHING_S]
    if not shared:
        return []
    begins = ", ".join("the start" if first == -np.inf else f"{first:g} s" for first, _ in shared)
    return [f"stretches overlap from {begins} on: fitted as one, no sample twice"]


def _fitted(t: Array) -> int:
    """Return how many samples of a part are behind the lead that is taken for its trim."""
    return int(np.sum(t > t[0] + LEAD_S)) if len(t) else 0


def _leading(columns: Mapping[str, Array], rows: IntArray) -> dict[str, float]:
    """Return by how much the surfaces moved that moved most."""
    swing = {axis: float(np.ptp(columns[axis][rows])) for axis in SURFACES if axis in columns}
    return {axis: size for axis, size in swing.items() if size > 0.5 * max(swing.values())}


def _given(
    columns: Mapping[str, Array], part: IntArray, whole: Mapping[str, float]
) -> list[DetectedManeuver]:
    """Return a part of a stretch once for each surface that leads in it.

    Behind a gap the aircraft may swing with its surfaces at rest: of what led in the `whole`.
    """
    t = columns["t_s"][part]
    leading = _leading(columns, part)
    rest = MOVED_SHARE * max(whole.values(), default=0.0)
    if max(leading.values(), default=0.0) < rest:
        leading = {axis: float(np.ptp(columns[axis][part])) for axis in whole}
    return [
        DetectedManeuver(
            axis=axis,
            kind="stretch",
            start_s=float(t[0]) + LEAD_S,
            input_end_s=float(t[-1]),
            end_s=float(t[-1]),
            amplitude=size / 2.0,
            edges=0,
            given=True,
        )
        # Any surface may be the one of a stretch at rest: the fit will say what it tells.
        for axis, size in (leading or {SURFACES[0]: 0.0}).items()
    ]


def joined_windows(
    each: Sequence[Sequence[DetectedManeuver]],
) -> list[list[DetectedManeuver]]:
    """Return the maneuvers of one model in each flight, as they are fitted.

    Windows that share samples are one. Those that only touch, the aircraft left alone between them,
    stay apart where one can be held out and predicted; else they are one too, for a window costs
    constants of its own (yaw derivatives of a calm record are known up to 1.5 times worse).
    """
    joined = [merge_overlapping(found) for found in each]
    axes = [item.axis for found in joined for item in found]
    if any(axes.count(axis) >= HELD_OUT_FROM for axis in axes):
        return joined
    return [_joined(found, _touching) for found in joined]


def merge_overlapping(found: Sequence[DetectedManeuver]) -> list[DetectedManeuver]:
    """Join windows that share samples: surfaces that moved together are one record."""
    return _joined(found, _overlapping)


def _joined(
    found: Sequence[DetectedManeuver], one: Callable[[DetectedManeuver, DetectedManeuver], bool]
) -> list[DetectedManeuver]:
    joined: list[DetectedManeuver] = []
    for item in sorted(found, key=lambda f: f.start_s):
        before = joined[-1] if joined else None
        if before is not None and one(before, item):
            joined[-1] = replace(
                before,
                input_end_s=max(before.input_end_s, item.input_end_s),
                end_s=max(before.end_s, item.end_s),
                free_end_s=max(before.free_end_s, item.free_end_s),
            )
        else:
            joined.append(item)
    return joined


def _overlapping(before: DetectedManeuver, item: DetectedManeuver) -> bool:
    return item.start_s < before.fit_window()[1] - TOUCHING_S


def _touching(before: DetectedManeuver, item: DetectedManeuver) -> bool:
    chosen = before.given or item.given  # as the user wants them
    return not chosen and item.fit_window()[0] < before.fit_window()[1] + TOUCHING_S


def excited_axes(inputs: Sequence[str]) -> tuple[str, ...]:
    """Return on which axes to look for maneuvers of a model: its inputs, or all that they name.

    `elevator_pot_rad` moves with the elevator; of `gust_mps` nobody knows when it moved.
    """
    axes = [a for a in AXES if any(name.split("_")[0] == a.split("_")[0] for name in inputs)]
    return tuple(axes) or AXES
