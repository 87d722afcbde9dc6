"""An input so small that the finder takes it for the pilot's handling: found by its shape.

Looked for only while the countdown says that it is due, for handling now and then has any shape.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.planning.aircraft_response import STEP_S, AircraftResponse
from host.planning.wanted_input import RESPONSE_S, SURFACES, wanted_surfaces
from host.sysid.maneuvers import DetectedManeuver
from host.twin.testcard.cards import Segment, input_s
from host.twin.testcard.input_shapes import STEPS

LEAST_SHARE, MOST_SHARE = 0.07, 0.6  # of the card's amplitude; what is larger the finder finds
LIKENESS = 0.85  # correlation with the card's shape, rest about it counted
_REST_S = 0.4


def weak_input(
    columns: Mapping[str, Array],
    wanted: Segment,
    response: AircraftResponse,
    due_s: tuple[float, float],
) -> DetectedManeuver | None:
    """Return the small copy of the card's input that began in a span of time and is over.

    Parameters
    ----------
    columns : mapping of str to (n,) Array
        SI, on an even grid.
    wanted : Segment
    response : AircraftResponse
        Gives the servo's lag.
    due_s : tuple of float
        First and last instant of its start.
    """
    own = [axis for axis in wanted.axes if axis in SURFACES]
    if wanted.kind not in STEPS or len(own) != 1:
        return None
    t, series = columns["t_s"], columns[f"{own[0]}_rad"]
    step_s = float(t[1] - t[0])
    shape, length_s = wanted_surfaces(wanted, response)[own[0]], input_s(wanted)
    at = np.arange(-_REST_S, length_s + _REST_S, step_s)
    model = np.interp(at, STEP_S * np.arange(len(shape)), shape, left=0.0)
    model -= model.mean()
    if len(series) < len(model):
        return None
    windows = np.lib.stride_tricks.sliding_window_view(series, len(model))
    windows = windows - windows.mean(axis=1, keepdims=True)
    share = windows @ model / (model @ model)
    size = np.sqrt(np.sum(windows**2, axis=1) * (model @ model))
    likeness = share * (model @ model) / np.maximum(size, 1e-12)
    start_s = t[: len(share)] + _REST_S
    usable = (start_s >= due_s[0]) & (start_s <= due_s[1])
    usable &= start_s + length_s + RESPONSE_S <= t[-1]
    usable &= (likeness > LIKENESS) & (share > LEAST_SHARE) & (share < MOST_SHARE)
    if not usable.any():
        return None
    best = int(np.argmax(np.where(usable, likeness, 0.0)))
    begin_s = float(start_s[best])
    return DetectedManeuver(
        axis=f"{own[0]}_rad",
        kind=wanted.kind,
        start_s=begin_s,
        input_end_s=begin_s + length_s,
        end_s=begin_s + length_s + RESPONSE_S,
        amplitude=float(share[best] * np.abs(shape).max()),
        edges=0,
    )
