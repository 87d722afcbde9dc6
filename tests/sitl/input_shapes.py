"""The shapes of protocol/flight-card.md, written from that page: whole numbers, 1 ms apart."""

from __future__ import annotations

import math
import struct

import numpy as np
from numpy.typing import NDArray

QUARTER = [round(16384 * math.sin(math.pi / 2 * i / 64)) for i in range(65)]
PULSE, DOUBLET, THREE_TWO_ONE_ONE, SWEEP, MULTISINE = range(1, 6)


def sin14(phase: int) -> int:
    """Return the sine of phase / 65536 turns in 1/16384."""
    quarter, p = divmod(phase & 0xFFFF, 16384)
    if quarter % 2:
        p = 16384 - p
    i = p >> 8
    value = (
        QUARTER[64] if i == 64 else QUARTER[i] + ((QUARTER[i + 1] - QUARTER[i]) * (p & 255) >> 8)
    )
    return -value if quarter >= 2 else value


def _cut(value: int, by: int) -> int:
    return value // by if value >= 0 else -(-value // by)


def deflection(row: bytes, axis: int, t: int) -> int:
    """Return the deflection of an axis in ticks, `t` ms behind the beginning of the shape."""
    shape, _, _, length, *rest = struct.unpack("<BBHH3hHH", row[:16])
    amplitude, (first, last) = 2 * rest[axis], rest[3:]
    if t >= length or amplitude == 0:
        return 0
    if shape == PULSE:
        return int(amplitude)
    if shape == DOUBLET:
        return int(amplitude if 2 * t < length else -amplitude)
    if shape == THREE_TWO_ONE_ONE:
        up = 7 * t < 3 * length or 5 * length <= 7 * t < 6 * length
        return int(amplitude if up else -amplitude)
    if shape == SWEEP:
        n = 16 * first * t + (last - first) * (8 * t * t // length)
        return _cut(amplitude * sin14(n % 1_600_000 * 2048 // 50_000), 16384)
    total = 0
    for harmonic, phase, share in struct.iter_unpack("<3B", row[16:46]):
        if harmonic and share >> 6 == axis:
            turn = harmonic * t * (4_294_967_295 // length) + (phase << 24)
            total += (share & 63) * sin14((turn & 0xFFFFFFFF) >> 16)
    value = _cut(_cut(total, 16) * amplitude, 65536)
    return int(max(-abs(amplitude), min(abs(amplitude), value)))


def shape_of(row: bytes) -> NDArray[np.float64]:
    """Return the deflections of the whole row, one per ms, by axis."""
    length = struct.unpack_from("<H", row, 4)[0]
    return np.array([[deflection(row, axis, t) for axis in range(3)] for t in range(length)], float)
