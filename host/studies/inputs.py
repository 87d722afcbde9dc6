"""Test inputs as the pilot flies them: 3-2-1-1, doublet, pulse, sampled and held."""

from __future__ import annotations

import numpy as np
from host.arrays import Array

LEAD_S = 1.0  # level flight before the first step


def steps(pattern: list[tuple[float, float]], dt_s: float, duration_s: float) -> Array:
    """Return a piecewise constant input, shape (samples, 1), from (duration, level) pairs."""
    time_s = np.arange(round(duration_s / dt_s)) * dt_s
    result = np.zeros((len(time_s), 1))
    begin = LEAD_S
    for length_s, level in pattern:
        inside = (time_s >= begin - 0.5 * dt_s) & (time_s < begin + length_s - 0.5 * dt_s)
        result[inside, 0] = level
        begin += length_s
    return result


def multistep_3211(amplitude: float, dt_s: float, duration_s: float, unit_s: float = 1.0) -> Array:
    """Return a 3-2-1-1 of unit step `unit_s`."""
    pattern = [(n * unit_s, s * amplitude) for n, s in ((3, 1), (2, -1), (1, 1), (1, -1))]
    return steps([(float(a), float(b)) for a, b in pattern], dt_s, duration_s)


def doublet(amplitude: float, dt_s: float, duration_s: float, half_s: float = 1.0) -> Array:
    """Return a doublet; the default is the 0.5 Hz of the thesis."""
    return steps([(half_s, amplitude), (half_s, -amplitude)], dt_s, duration_s)


def pulse(amplitude: float, dt_s: float, duration_s: float, width_s: float = 2.0) -> Array:
    """Return a single pulse; the default is the 2 s of the thesis."""
    return steps([(width_s, amplitude)], dt_s, duration_s)


SHAPES = {"3-2-1-1": multistep_3211, "pulse": pulse, "doublet": doublet}
