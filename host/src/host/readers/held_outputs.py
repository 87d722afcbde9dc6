"""What an output was between two of its records: a servo keeps its last pulse until the next.

Of outputs that are logged less often than they change, the pulses between are drawn on the line
between the two records, each standing until the next one: a step between two records is then where
it was on average. A line through the records alone would move a surface before it was told to, by
10 ms where every second of 50 pulses is logged.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.readers.signals import Signal

STEP_S = 0.005  # of the rows that carry a held value: a fortieth of a short period of 5 Hz
DENSE_HZ = 100.0  # logged as often, an output is taken as it is
LONGEST_HOLD_S = 0.25  # behind it an output is unknown


def held_output(signal: Signal, period_s: float) -> tuple[Array, Array]:
    """Return instants and values of an output that stands from one pulse to the next.

    Parameters
    ----------
    signal : Signal
        As logged.
    period_s : float
        Of the pulses.
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
    out = values[before] + at_pulse * (values[before + 1] - values[before])
    out[length_s > max(LONGEST_HOLD_S, 3.0 * usual_s)] = np.nan
    return rows, np.asarray(out)
