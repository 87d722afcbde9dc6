"""Rows of a flight for other programs: those where something was measured."""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.report.shown_flight import ShownFlight


def exported_rows(flight: ShownFlight, rate_hz: float | None = None) -> dict[str, Array]:
    """Return the columns without the rows that stand for a gap.

    Parameters
    ----------
    flight : ShownFlight
    rate_hz : float, optional
        At most so many rows a second: the first of each interval. All without it.

    Returns
    -------
    dict of str to (rows,) array
        SI; NaN where a channel was not valid.
    """
    columns = flight.columns
    seen = np.zeros(len(flight.t_s), bool)
    for name, values in columns.items():
        if name != "t_s":
            seen |= np.isfinite(values)
    at = np.flatnonzero(seen)
    if rate_hz is not None and len(at):
        interval = np.floor((flight.t_s[at] - flight.t_s[at[0]]) * rate_hz + 1e-6)
        at = at[np.r_[True, np.diff(interval) > 0]]
    return {name: values[at] for name, values in columns.items()}


def interpolated(t_s: Array, own_s: Array, values: Array) -> Array:
    """Return a channel at other instants, linearly; 0 where it was never measured."""
    known = np.isfinite(values)
    if not known.any():
        return np.zeros(len(t_s))
    return np.interp(t_s, own_s[known], values[known])
