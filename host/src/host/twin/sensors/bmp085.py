"""BMP085: the data sheet's integer compensation, and the raw values that lead to a pressure.

Bosch BST-BMP085-DS000, figure 3; coefficients of its own example, as other firmware's unit tests
use them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array

Integers = NDArray[np.int64]
NOISE_PA = 3.0  # rms at the highest resolution (Bosch, as the thesis quotes it)


class Coefficients(NamedTuple):
    """The eleven words of the sensor's EEPROM, in its order."""

    ac1: int
    ac2: int
    ac3: int
    ac4: int
    ac5: int
    ac6: int
    b1: int
    b2: int
    mb: int
    mc: int
    md: int


EXAMPLE = Coefficients(408, -72, -14383, 32741, 32757, 23153, 6190, 4, -32768, -8711, 2868)
# An erased EEPROM: every bit set; AC4 to AC6 are unsigned.
BLANK = Coefficients(-1, -1, -1, 0xFFFF, 0xFFFF, 0xFFFF, -1, -1, -1, -1, -1)


def _truncate(a: Integers, b: Integers | int) -> Integers:
    """Divide as C does, towards zero."""
    quotient = np.abs(a) // np.abs(b)
    return np.asarray(np.where((a < 0) != (np.asarray(b) < 0), -quotient, quotient))


def compensate(
    ut: Integers, up: Integers, oss: int, c: Coefficients = EXAMPLE
) -> tuple[Integers, Integers]:
    """Return temperature (0.1 degC) and pressure (Pa) of raw values, arrays of one shape."""
    x1 = ((ut - c.ac6) * c.ac5) >> 15
    x2 = _truncate(np.full_like(x1, c.mc * 2048), x1 + c.md)
    b5 = x1 + x2
    temperature = (b5 + 8) >> 4
    b6 = b5 - 4000
    x3 = ((c.b2 * ((b6 * b6) >> 12)) >> 11) + ((c.ac2 * b6) >> 11)
    b3 = (((c.ac1 * 4 + x3) << oss) + 2) // 4
    x1 = (c.ac3 * b6) >> 13
    x2 = (c.b1 * ((b6 * b6) >> 12)) >> 16
    b4 = (c.ac4 * (((x1 + x2 + 2) >> 2) + 32768)) >> 15
    b7 = (up - b3) * (50000 >> oss)
    p = np.where(b7 < 0x80000000, (b7 * 2) // b4, (b7 // b4) * 2)
    x1 = ((p >> 8) ** 2 * 3038) >> 16
    x2 = (-7357 * p) >> 16
    return temperature, np.asarray(p + ((x1 + x2 + 3791) >> 4))


def raw_temperature(temperature_degc: Array, c: Coefficients = EXAMPLE) -> Integers:
    """Return UT for temperatures between -40 and 85 degC, to 0.1 degC."""
    return _search(lambda ut: compensate(ut, np.full_like(ut, 23843), 0, c)[0],
                   np.round(np.asarray(temperature_degc) * 10.0), 16000, 45000)  # fmt: skip


def raw_pressure(pressure_pa: Array, ut: Integers, oss: int, c: Coefficients = EXAMPLE) -> Integers:
    """Return UP for pressures between 300 and 1100 hPa at the raw temperature `ut`."""
    return _search(
        lambda up: compensate(ut, up, oss, c)[1], np.round(pressure_pa), 0, (1 << (16 + oss)) - 1
    )


def _search(function: object, target: Array, low: int, high: int) -> Integers:
    """Bisect for the least integer whose value reaches the target; the functions rise."""
    assert callable(function)
    lower = np.full(np.shape(target), low, dtype=np.int64)
    upper = np.full(np.shape(target), high, dtype=np.int64)
    while np.any(upper > lower):
        middle = (lower + upper) // 2
        reached = function(middle) >= target
        upper = np.where(reached, middle, upper)
        lower = np.where(reached, lower, np.minimum(middle + 1, upper))
    return lower
