"""Servo outputs between two of their records: a servo keeps its last pulse until the next.

Where outputs are logged less often than they change, the missing pulses are interpolated by the
cubic through four records, and each is held until the next one. Straight lines through the records
would move a surface before its command, by 10 ms where every second of 50 pulses a second is
logged. Held pulses on a straight line lose 3.5 % of a motion of 3 Hz, which makes Cm_alpha and
Cm_de 9 % large; on the cubic they lose 0.4 %.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array, IntArray
from host.readers.even_grid import LONGEST_GAP_S
from host.readers.signals import Signal

STEP_S = 0.005  # step of rows that repeat a held value: a fortieth of a 5 Hz short period
DENSE_HZ = 100.0  # an output logged at this rate or more is not interpolated
UNEVEN = 0.2  # unevenness of four records, as a share of their span, above which one is missing


def held_output(signal: Signal, period_s: float) -> tuple[Array, Array]:
    """Return instants and values of an output that stands from one pulse to the next.

    Parameters
    ----------
    signal : Signal
        As logged.
    period_s : float
        Period of the pulses.
    """
    t, values = signal.t_s, signal.values
    usual_s = 1.0 / signal.rate_hz if signal.rate_hz else 0.0
    if len(t) < 2 or signal.rate_hz >= DENSE_HZ:
        return t, values
    rows = np.arange(t[0], t[-1], STEP_S)
    before = np.clip(np.searchsorted(t, rows + 1e-9, side="right") - 1, 0, len(t) - 2)
    pulses = max(1, round(usual_s / max(period_s, 1e-3)))  # from one record to the next
    length_s = t[before + 1] - t[before]
    share = np.clip((rows - t[before]) / np.maximum(length_s, 1e-9), 0.0, 1.0)
    at_pulse = np.floor(share * pulses + 1e-6) / pulses
    out = _between(t, values, before, at_pulse)
    out[length_s > max(LONGEST_GAP_S, 3.0 * usual_s)] = np.nan
    return rows, np.asarray(out)


def _between(t: Array, values: Array, before: IntArray, share: Array) -> Array:
    """Return values between records on a cubic through four, or on a line where none can be.

    Parameters
    ----------
    t, values : Array, shape (m,)
    before : IntArray, shape (n,)
        Record before each instant.
    share : Array, shape (n,)
        Share of the way to the next.
    """
    line = values[before] + share * (values[before + 1] - values[before])
    s, last = share, len(values) - 1
    first, fourth = np.maximum(before - 1, 0), np.minimum(before + 2, last)
    curve = (
        -s * (s - 1.0) * (s - 2.0) / 6.0 * values[first]
        + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * values[before]
        - (s + 1.0) * s * (s - 2.0) / 2.0 * values[before + 1]
        + (s + 1.0) * s * (s - 1.0) / 6.0 * values[fourth]
    )
    across = t[fourth] - t[first]  # of four even records three times their distance
    even = np.abs(across - 3.0 * (t[before + 1] - t[before])) < UNEVEN * across
    inside = (before >= 1) & (before + 2 <= last) & even & np.isfinite(curve)
    return np.asarray(np.where(inside, curve, line))
