"""Pulses behind the printed surfaces: the thesis's maps (appendix C), both ways.

Receiver to servo: the range of its transmitter is stretched to 1000 to 2000 us by `map`. Servo to
row: a line of degrees for each surface; the throttle less 1009 us. The rudder's map is two lines
that do not meet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RANGE_US = {  # in the order of the channels
    "aileron": (1100, 1956),
    "elevator": (1152, 1904),
    "rudder": (1124, 1904),
    "throttle": (1100, 1960),
}
_LINES = {
    "aileron": ((0.0738, 112.29),),
    "elevator": ((0.0756, 108.72),),
    "rudder": ((0.0555, 73.335), (0.0333, 45.434)),
    "throttle": ((1.0, 1009.0),),
}
_MEET_US = 1348.0  # of the rudder's lines: the first below, the second from there on
_PRINTED_TO = 0.5  # us: a row has two decimals
_BELIEVED_US = (900.0, 2100.0)  # before the first pulse the map says less than nothing


def servo_of_stick_us(stick_us: Array, surface: str) -> Array:
    """Return the pulse to the servo for the receiver's: Arduino's `map`, in integers."""
    low, high = RANGE_US[surface]
    return np.trunc((np.trunc(stick_us) - low) * 1000 / (high - low)) + 1000


def printed_of_servo(servo_us: Array, surface: str) -> Array:
    """Return what a row says: degrees, of the throttle microseconds above idle."""
    lines = [slope * servo_us - offset for slope, offset in _LINES[surface]]
    return np.where(servo_us < _MEET_US, lines[0], lines[-1])


def servo_us_of_printed(printed: Array, surface: str) -> Array:
    """Return the pulse to the servo behind a printed value.

    NaN where there is none, or where two explain it: a rudder between -0.55 and 1.48.
    """
    found = [(printed + offset) / slope for slope, offset in _LINES[surface]]
    if len(found) == 1:
        return _believed(found[0], surface)
    below = found[0] < _MEET_US + _PRINTED_TO
    above = found[1] > _MEET_US - _PRINTED_TO
    one = np.where(below, found[0], found[1])
    return _believed(np.where(below != above, one, np.nan), surface)


def stick_us_of_servo(servo_us: Array, surface: str) -> Array:
    """Return the receiver's pulse behind one to the servo, to 1 us."""
    low, high = RANGE_US[surface]
    return np.asarray(low + (servo_us - 1000.0) * (high - low) / 1000.0, np.float64)


def _believed(servo_us: Array, surface: str) -> Array:
    stick_us = stick_us_of_servo(servo_us, surface)
    good = (stick_us >= _BELIEVED_US[0]) & (stick_us <= _BELIEVED_US[1])
    return np.asarray(np.where(good, servo_us, np.nan), np.float64)
