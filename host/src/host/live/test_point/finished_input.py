"""Find the input that was just flown, and tell when its point is over.

The finder is that of `host maneuvers`. Surfaces are shown to it larger where the card's input is
small, so that a third of it still has edges. What is smaller is looked for by `weak_input`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from host.arrays import Array, IntArray
from host.planning.wanted_input import RESPONSE_S, SURFACES
from host.sysid.maneuvers.maneuver_detection import (
    FLYING_SHARE,
    LEAST_EDGE_RAD,
    DetectedManeuver,
    detect_maneuvers,
)
from host.twin.testcard.cards import Segment, input_s

LEAST_SHARE = 0.3  # of the card's amplitude: less is the pilot's handling
ATTEMPT_SHARE = 0.5  # of it on another axis: more is a test input on the wrong one
LEAST_S, LONGEST = 0.15, 4.0  # of an input; times the card's, longer is handling
AIRBORNE_S = 3.0  # a launch moves every surface


def finished_inputs(
    columns: Mapping[str, Array], wanted: Segment, airspeed_mps: float, since_s: float
) -> list[DetectedManeuver]:
    """Return the inputs that began after an instant and whose response is over.

    Parameters
    ----------
    columns : mapping of str to (n,) Array
        As `RecentFlight.columns` gives them.
    wanted : Segment
        The card's next point.
    airspeed_mps : float
        The card's; at less than half of it nothing is flown.
    since_s : float
    """
    if not all(f"{axis}_rad" in columns for axis in SURFACES) or "airspeed_mps" not in columns:
        return []
    t = columns["t_s"]
    flying = columns["airspeed_mps"] > FLYING_SHARE * airspeed_mps
    grounded = np.flatnonzero(~flying)
    since = int(grounded[-1]) + 1 if len(grounded) else 0
    if t[-1] - t[min(since, len(t) - 1)] < AIRBORNE_S + RESPONSE_S:
        return []
    size = math.radians(max((a for a in wanted.amplitudes), default=3.0))
    gain = max(1.0, LEAST_EDGE_RAD / (LEAST_SHARE * size))
    shown = {"t_s": t[since:], "airspeed_mps": columns["airspeed_mps"][since:]}
    nearest = _nearest_arrived(columns["arrived"])[since:]
    shown |= {f"{axis}_rad": gain * columns[f"{axis}_rad"][nearest] for axis in SURFACES}
    longest_s = LONGEST * input_s(wanted)
    found = []
    for item in detect_maneuvers(shown):
        own = item.axis.removesuffix("_rad") in wanted.axes
        share = item.amplitude / gain / size
        over = t[-1] >= item.input_end_s + RESPONSE_S
        long = LEAST_S <= item.input_end_s - item.start_s <= longest_s
        if (
            item.start_s > max(since_s, float(t[since]) + AIRBORNE_S)
            and over
            and long
            and share > (LEAST_SHARE if own else ATTEMPT_SHARE)
        ):
            found.append((not own, item))
    # The wanted axis first: with it others are handling.
    return [item for _, item in sorted(found, key=lambda one: (one[0], one[1].start_s))]


def _nearest_arrived(arrived: Array) -> IntArray:
    """Return for each row the nearest that came: a line over a burst has no edges, a step has."""
    came = np.flatnonzero(arrived > 0.0)
    middle = 0.5 * (came[1:] + came[:-1])
    return np.asarray(came[np.searchsorted(middle, np.arange(len(arrived)))])
