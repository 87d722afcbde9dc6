"""Find servo pulses that jump and return within 0.15 s while the stick stands still.

The thesis's servos twitched about once in ten seconds with nobody at the stick (5.1.4). Test
inputs that the recorder flies also move servos without the stick, a multisine as fast, so the
caller leaves their time out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_US = 20.0  # of pulse, about 2 deg of a surface; receivers jitter by 2
STILL_US = 8.0  # the stick's pulse from row to row
LONGEST_S = 0.15  # away
LOOKED_BACK_S = 0.1  # the servo may follow the stick this much later


def servo_jumps(t_s: Array, servo_us: Array, stick_us: Array, drives: NDArray[np.bool_]) -> Array:
    """Return when a servo's pulse jumped and came back though the stick did not move.

    Parameters
    ----------
    t_s : (rows,) array
        Rising, s.
    servo_us, stick_us : (rows,) array
        Pulses sent and received, us.
    drives : (rows,) array
        Where servos get the pulses sent.

    Returns
    -------
    (jumps,) array
        Time of the row before each, s.
    """
    if len(t_s) < 3:
        return np.empty(0)
    step = np.diff(servo_us)
    at = np.flatnonzero((np.abs(step) >= LEAST_US) & drives[1:] & drives[:-1])
    first, second = at[:-1], at[1:]
    # The value returns within its tolerance of where it was.
    back = np.abs(servo_us[second + 1] - servo_us[first]) < LEAST_US / 2.0
    short = t_s[second + 1] - t_s[first] <= LONGEST_S + 1e-9
    found = np.flatnonzero(back & short & (np.sign(step[first]) != np.sign(step[second])))
    if not len(found):
        return np.empty(0)
    moved = np.concatenate([[0], np.cumsum(np.abs(np.diff(stick_us)) >= STILL_US)])
    begin = np.searchsorted(t_s, t_s[first[found]] - LOOKED_BACK_S)
    still = moved[second[found] + 1] == moved[begin]
    return np.asarray(t_s[first[found][still]])
