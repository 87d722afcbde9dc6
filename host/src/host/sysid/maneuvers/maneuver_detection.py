"""Find the maneuvers of a flight from its control inputs, name and grade them.

A pilot's test input moves a surface far and fast; corrections move it little and slowly. Edges are
changes over a short lag that stand out of the surface's own activity; edges of one axis that follow
each other closely are one input. The window ends three seconds after the last edge, or where the
next input begins.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.sysid.maneuvers.free_response import with_free_response
from host.sysid.maneuvers.logged_inputs import logged_inputs, without_held
from host.sysid.maneuvers.overlapping_inputs import WEAKER, bounded, rad_of, without_echoes
from host.sysid.maneuvers.sustained_inputs import QUIET, sustained_inputs

LAG_S = 0.12  # a hand needs about this long for one edge
LEAST_EDGE_RAD = 0.025  # 1.4 degrees: a pulse smaller than this excites nothing on a trainer
STILL_RAD = 1e-3  # a surface that moves less moves nothing
THROTTLE = (-0.2, 1.2)  # beyond, it is no share of full
ACTIVITY = 6.0  # edges stand out by this many robust deviations of the surface's activity
JOIN_S = 1.6  # between edges of one input
HOLD_S = 6.0  # longest step of an input
SLOW_RAD = 0.007  # least swing of an input without edges
AWAY = 0.3  # of an input, or of the answer to it: what is further from its rest is not at rest
OUT = 0.4  # of an input: the surface stands at one side
PARTING_GAP_S = 5.0
SHORTEST_PART_S = 1.0  # of a maneuver that a gap divides
REACH_BACK_S = 0.5  # of a fit of coefficients before the start of a maneuver
FEWEST = 8  # samples, as a maneuver needs
STEADY_TREND = 0.6  # rank correlation of swing length with order: a sweep's swings shorten
RESPONSE_S = 3.0  # the window reaches this long past the last edge
LEAD_S = 0.3  # of trim before the input, in a fit
TRIM_S = 1.0  # quiet time before the input
FLYING_SHARE = 0.5  # of the median airspeed: slower is not flight
AXES = ("elevator_rad", "aileron_rad", "rudder_rad", "throttle")
RESPONSE_OF = {
    "elevator_rad": "q_radps",
    "aileron_rad": "p_radps",
    "rudder_rad": "r_radps",
    "throttle": "airspeed_mps",
}


@dataclass(frozen=True, slots=True)
class DetectedManeuver:
    """One test input and its response, times in the time of the table, s."""

    axis: str
    kind: str
    start_s: float
    input_end_s: float
    end_s: float
    amplitude: float
    edges: int
    given: bool = False  # by the user, as a stretch of time: a maneuver whatever moved in it
    swings: bool = False  # without an edge that stands out
    lead_s: float = LEAD_S  # before the input, in a fit
    free_end_s: float = -np.inf  # until then the aircraft was left alone, if that is after `end_s`

    def fit_window(self) -> tuple[float, float]:
        """Return from and to, with trim before the input and all of the free response."""
        return self.start_s - self.lead_s, max(self.end_s, self.free_end_s)

    def response(self) -> DetectedManeuver:
        """Return input and first response alone, as a prediction is judged by."""
        return replace(self, lead_s=min(self.lead_s, LEAD_S), free_end_s=-np.inf)


def detect_maneuvers(columns: Mapping[str, Array]) -> list[DetectedManeuver]:
    """Return the maneuvers of a flight in order of time.

    Parameters
    ----------
    columns : mapping
        `t_s` and any of `elevator_rad`, `aileron_rad`, `rudder_rad`, `throttle`; `airspeed_mps`
        keeps ground handling out; where `bridged` is not zero (`tables`) a maneuver is divided.
    """
    t = np.asarray(columns["t_s"], dtype=np.float64)
    flying = np.ones(len(t), dtype=bool)
    if "airspeed_mps" in columns:
        speed = np.abs(np.nan_to_num(np.asarray(columns["airspeed_mps"])))
        flying = speed > FLYING_SHARE * float(np.median(speed))
    found: list[DetectedManeuver] = []
    for record in _records(t, columns):
        own = {name: np.asarray(values)[record] for name, values in columns.items()}
        found += _of_record(own, flying[record])
    return found


def _records(t: Array, columns: Mapping[str, Array]) -> list[slice]:
    """Return the parts between gaps so long that what is behind one is another record."""
    if "bridged" not in columns:
        return [slice(0, len(t))]
    runs = [r for r in runs_of(np.asarray(columns["bridged"]) <= 0.0) if len(r)]
    ends = [(int(r[0]), int(r[-1]) + 1) for r in runs]
    parted: list[tuple[int, int]] = []
    for first, last in ends:
        if parted and t[first] - t[parted[-1][1] - 1] < PARTING_GAP_S:
            parted[-1] = (parted[-1][0], last)
        else:
            parted.append((first, last))
    return [slice(first, last) for first, last in parted]


def _of_record(columns: Mapping[str, Array], flying: BoolArray) -> list[DetectedManeuver]:
    t = np.asarray(columns["t_s"], dtype=np.float64)
    if len(t) < FEWEST:
        return []
    surfaces = {
        axis: _median3(np.nan_to_num(np.asarray(columns[axis], dtype=np.float64)))
        for axis in AXES
        if axis in columns
    }
    if "throttle" in surfaces:
        surfaces["throttle"] = _share_of_full(surfaces["throttle"])
    found: list[DetectedManeuver] = []
    for axis, series in surfaces.items():
        rate = np.nan_to_num(np.asarray(columns.get(RESPONSE_OF[axis], np.zeros(len(t)))))
        found += _find_axis(axis, t, series, flying, rate)
    found.sort(key=lambda f: f.start_s)
    found = bounded(without_echoes(found, {**columns, **surfaces, "t_s": t}), float(t[-1]))
    logged = logged_inputs(columns, surfaces)
    if logged:
        found = _with_logged_windows(logged, without_held(columns, found), float(t[-1]))
    if "bridged" in columns:
        measured = ~(np.asarray(columns["bridged"]) > 0.0)
        found = [part for f in found for part in _parts(f, t, measured)]
        flying = flying & measured
    return with_free_response(found, t, surfaces, flying)


def _share_of_full(throttle: Array) -> Array:
    """Return throttle as a share of its largest value where it is no share of full: in per cent
    its least motion would hide the surfaces."""
    largest = float(np.max(np.abs(throttle)))
    return throttle / largest if largest > THROTTLE[1] else throttle


def _parts(item: DetectedManeuver, t: Array, measured: BoolArray) -> list[DetectedManeuver]:
    """Return the parts of a maneuver between gaps of the data; itself if there is none."""
    inside = (t > item.start_s) & (t < item.end_s)
    if measured[inside].all():
        return [item]
    inside |= (t >= item.start_s - item.lead_s) & (t <= item.end_s)
    parts = []
    for samples in runs_of(measured & inside):
        first_s, last_s = float(t[samples[0]]), float(t[samples[-1]])
        if last_s - first_s >= SHORTEST_PART_S:
            begin_s = item.start_s if first_s <= item.start_s else first_s + REACH_BACK_S
            input_end_s = float(np.clip(item.input_end_s, begin_s, last_s))
            parts.append(replace(item, start_s=begin_s, input_end_s=input_end_s, end_s=last_s))
    return parts


def _find_axis(
    axis: str, t: Array, series: Array, flying: BoolArray, rate: Array
) -> list[DetectedManeuver]:
    dt_s = float(np.median(np.diff(t)))
    lag = max(1, round(LAG_S / dt_s))
    # One row that is shorter than an edge shows each edge in two halves.
    lag += lag == 1 and dt_s < LAG_S
    groups = _edges(axis, t, series, flying, lag)
    groups = _join_held(groups, t, series, lag)
    slow = sustained_inputs(t, series, flying, SLOW_RAD / rad_of(axis))
    result = []
    for first, last in _united(groups, slow, series, lag):
        sharp = any(first <= begin <= last for begin, _ in groups)
        for item in _describe(axis, t, series, (first, last), lag, rate if flying[0] else None):
            result.append(replace(item, swings=not sharp))
    return result


def _edges(
    axis: str, t: Array, series: Array, flying: BoolArray, lag: int
) -> list[tuple[int, int]]:
    """Return first and last edge of each input: changes that stand out of the activity."""
    change = np.zeros(len(t))
    change[lag:] = series[lag:] - series[:-lag]
    change[~flying] = 0.0
    # A low quantile, because a sweep can fill most of a record; of a normal one it is 0.253 sigma.
    quiet = float(np.quantile(np.abs(change[flying]), QUIET)) / 0.253 if flying.any() else 0.0
    least = LEAST_EDGE_RAD / rad_of(axis)
    hot = np.flatnonzero(np.abs(change) > max(least, ACTIVITY * quiet))
    if len(hot) == 0:
        return []
    groups = np.split(hot, np.flatnonzero(np.diff(t[hot]) > JOIN_S) + 1)
    return [(int(group[0]), int(group[-1])) for group in groups]


def _join_held(
    groups: list[tuple[int, int]], t: Array, series: Array, lag: int
) -> list[tuple[int, int]]:
    """Join edges between which the surface is held away from where it was: a slow 3-2-1-1."""
    joined: list[tuple[int, int]] = []
    for first, last in groups:
        if joined:
            begin, end = joined[-1]
            rest = float(np.median(series[max(0, begin - 3 * lag) : max(1, begin - lag)]))
            away = np.abs(series[end : first - lag] - rest)
            size = float(np.max(np.abs(series[begin : last + 1] - rest)))
            held = len(away) > 0 and bool(np.min(away) > AWAY * size)
            if held and t[first] - t[end] < HOLD_S:
                joined[-1] = (begin, last)
                continue
        joined.append((first, last))
    return joined


def _united(
    edges: list[tuple[int, int]], slow: list[tuple[int, int]], series: Array, lag: int
) -> list[tuple[int, int]]:
    """Return the spans of all inputs in order; those that share samples are one."""
    slow = [span for span in slow if not _stirs(span, edges, series, lag)]
    united: list[tuple[int, int]] = []
    for first, last in sorted([*edges, *slow]):
        if united and slow and first <= united[-1][1]:
            united[-1] = (united[-1][0], max(last, united[-1][1]))
        else:
            united.append((first, last))
    return united


def _stirs(span: tuple[int, int], edges: list[tuple[int, int]], series: Array, lag: int) -> bool:
    """Return whether swings are but the pilot's, before or after a larger input with edges."""
    inside = [(a, b) for a, b in edges if a <= span[1] and b >= span[0]]
    rest = np.ones(len(series), dtype=bool)
    rest[: span[0]] = rest[span[1] + 1 :] = False
    for first, last in inside:
        rest[max(0, first - 2 * lag) : last + 2 * lag] = False
    if len(inside) != 1 or not rest.any():
        return False
    first, last = inside[0]
    return float(np.ptp(series[rest])) < WEAKER * float(np.ptp(series[first : last + 1]))


def _describe(
    axis: str, t: Array, series: Array, span: tuple[int, int], lag: int, rate: Array | None
) -> list[DetectedManeuver]:
    first, last = span
    settle = float(np.median(series[last : last + 4 * lag + 1]))
    before = series[max(0, first - lag - round(TRIM_S / float(t[1] - t[0]))) : max(1, first - lag)]
    trim = float(np.median(before))
    if rate is not None and _begins_inside(t, series, first, settle, rate):
        first, trim = 0, settle
    inside = series[first : last + 1] - trim
    amplitude = float(np.max(np.abs(inside)))
    # Walk back to the departure and forward to the return, a fifth of the edge at a time.
    start = first
    while start > 0 and first - start < 2 * lag and abs(series[start] - trim) > 0.15 * amplitude:
        start -= 1
    end = last
    while end > first and abs(series[end] - settle) < 0.15 * amplitude:
        end -= 1
    runs = _runs(inside / max(amplitude, 1e-12), t[first : last + 1])
    if len(runs) == 0:
        return []
    if len(runs) < 3 and abs(settle - trim) > 0.6 * amplitude:
        return []  # a step that stays is a change of trim (a launch), not a test input
    return [
        DetectedManeuver(
            axis=axis,
            kind=_kind(runs),
            start_s=float(t[start]),
            input_end_s=float(t[min(end + 1, len(t) - 1)]),
            end_s=float(t[min(end + 1, len(t) - 1)]) + RESPONSE_S,
            amplitude=amplitude,
            edges=len(runs) + 1,
        )
    ]


def _begins_inside(t: Array, series: Array, first: int, settle: float, rate: Array) -> bool:
    """Return whether the record begins in an input whose first edge seen is `first`.

    It is away from where it comes to rest. A single step may be one of trim as well, and is taken
    for that, but where the aircraft turned already.
    """
    if t[first] - t[0] > HOLD_S:
        return False
    away = series[: first + 1] - settle
    behind = series[first:] - settle
    size = max(float(np.max(np.abs(away))), float(np.max(np.abs(behind))))
    held = bool(np.median(np.abs(away)) > AWAY * size)
    both = bool(np.min(behind * np.sign(away[0])) < -AWAY * size)
    return held and (both or _turns_already(away, rate, first, size))


def _turns_already(away: Array, rate: Array, first: int, size: float) -> bool:
    """Return whether an aircraft answers a held surface as it answers the edge that ends it."""
    held = round(0.8 * first)  # the edge itself aside
    before, after = rate[:held], rate[first : 2 * first + 1]
    if held < FEWEST or np.ptp(away[:held]) > AWAY * size:
        return False
    return bool(np.std(before) > AWAY * np.std(after) > 0.0)


def _runs(level: Array, t: Array) -> list[tuple[int, float]]:
    """Return (sign, duration) of successive stretches above half amplitude."""
    sign = np.where(level > OUT, 1, np.where(level < -OUT, -1, 0))
    runs: list[tuple[int, float]] = []
    start = 0
    for k in range(1, len(sign) + 1):
        if k == len(sign) or sign[k] != sign[start]:
            length = float(t[k - 1] - t[start])
            if sign[start] != 0 and length > 0.03:
                runs.append((int(sign[start]), length))
            start = k
    return runs


def _kind(runs: list[tuple[int, float]]) -> str:
    signs = [s for s, _ in runs]
    lengths = np.array([length for _, length in runs])
    alternating = all(a != b for a, b in itertools.pairwise(signs))
    if len(runs) == 1:
        return "pulse"
    if len(runs) == 2 and alternating:
        return "doublet"
    if len(runs) == 4 and alternating:
        share = lengths / lengths.sum()
        pattern = np.array([3.0, 2.0, 1.0, 1.0]) / 7.0
        if float(np.max(np.abs(share - pattern))) < 0.12:
            return "3-2-1-1"
    if len(runs) >= 6:
        rank = np.argsort(np.argsort(lengths))
        trend = float(np.corrcoef(rank, np.arange(len(rank)))[0, 1])
        return "sweep" if abs(trend) > STEADY_TREND else "multisine"
    return "multistep"


def runs_of(chosen: BoolArray) -> list[IntArray]:
    """Return the positions of each unbroken run of chosen samples."""
    index = np.flatnonzero(chosen)
    return np.split(index, np.flatnonzero(np.diff(index) > 1) + 1) if len(index) else []


def _median3(series: Array) -> Array:
    padded = np.concatenate([series[:1], series, series[-1:]])
    low, high = np.minimum(padded[:-2], padded[2:]), np.maximum(padded[:-2], padded[2:])
    return np.asarray(np.clip(series, low, high))


def _with_logged_windows(
    logged: Mapping[tuple[str, float, float], tuple[str, float]],
    found: list[DetectedManeuver],
    last_s: float,
) -> list[DetectedManeuver]:
    """Return the inputs that the logger flew with their exact windows, and others next to them."""
    spans = [(start_s, end_s) for _, start_s, end_s in logged]
    others = [
        item
        for item in found
        if not any(item.start_s < end_s and item.input_end_s > start_s for start_s, end_s in spans)
    ]
    starts = sorted([*(start_s for start_s, _ in spans), *(item.start_s for item in others)])
    exact = [
        DetectedManeuver(
            axis=axis,
            kind=kind,
            start_s=start_s,
            input_end_s=end_s,
            end_s=min([end_s + RESPONSE_S, last_s, *(s for s in starts if s >= end_s)]),
            amplitude=amplitude,
            edges=0,
        )
        for (axis, start_s, end_s), (kind, amplitude) in logged.items()
    ]
    return sorted([*exact, *others], key=lambda f: f.start_s)
