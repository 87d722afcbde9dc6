"""The pilot tilts the aircraft on the ground: right wing down, then nose up (hw/test-inputs.md)."""

from __future__ import annotations

import math

import numpy as np

from host.aircraft.airframe import Q0, Q3, Array, P, Q
from host.aircraft.attitude import multiply, quaternion

# Behind the sign that enables the card, one after the other; the stick stands against each.
ROLLED_S, PITCHED_S = 16.2, 21.2
TILTING_S, SHOWN_S = 0.5, 3.5
TILT_RAD = math.radians(25.0)
END_S = PITCHED_S + 2 * TILTING_S + SHOWN_S + 0.3


def tilted(rest: Array, count: int, step_s: float) -> Array:
    """Return the states (count, 17) on the ground.

    Parameters
    ----------
    rest : (17,) array
        Untouched.
    count : int
        Steps on the ground.
    step_s : float

    Returns
    -------
    (count, 17) array
    """
    t = np.arange(count) * step_s
    states = np.repeat(rest[None], count, axis=0)
    for begin_s, rate in ((ROLLED_S, P), (PITCHED_S, Q)):
        times = begin_s + np.array([0.0, TILTING_S, TILTING_S + SHOWN_S, 2 * TILTING_S + SHOWN_S])
        angle = np.interp(t, times, [0.0, TILT_RAD, TILT_RAD, 0.0])
        states[:, rate] = np.gradient(angle, step_s)
        for i in np.flatnonzero(angle):
            roll_rad, pitch_rad = (angle[i], 0.0) if rate == P else (0.0, angle[i])
            turn = quaternion(roll_rad, pitch_rad, 0.0)
            states[i, Q0 : Q3 + 1] = multiply(rest[Q0 : Q3 + 1], turn)
    return states
