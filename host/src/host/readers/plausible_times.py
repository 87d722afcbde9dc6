"""Find records with a possible time: near that of their neighbours, never backwards."""

from __future__ import annotations

import numpy as np

from host.arrays import Array, BoolArray

NEAR_S, NEAR_STEPS = 1.0, 20.0  # from the median of the five around: beyond, a bit was changed
EARLIEST_S, LONGEST_S = -60.0, 30 * 86400.0  # of a time since boot


def plausible_times(t_s: Array) -> tuple[BoolArray, int]:
    """Return which of the times (n,) are possible, and how many are not.

    A time far from the median of the five around it is wrong. A pause in the log is no error,
    since the median lies on the record's own side of it. Times that still step back are left out
    too.
    """
    steps = np.diff(t_s)
    if len(t_s) > 1 and t_s[0] > EARLIEST_S and t_s[-1] < LONGEST_S:
        usual_s = NEAR_STEPS * float(np.median(steps))
        if steps.min() >= 0.0 and steps.max() <= max(NEAR_S, usual_s):
            return np.ones(len(t_s), dtype=bool), 0
    ok = np.isfinite(t_s) & (t_s > EARLIEST_S) & (t_s < LONGEST_S)
    if ok.sum() >= 5:
        kept = t_s[ok]
        padded = np.concatenate([kept[:2], kept, kept[-2:]])
        around = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
        far_s = max(NEAR_S, NEAR_STEPS * float(np.median(np.abs(np.diff(kept)))))
        ok[np.flatnonzero(ok)[np.abs(kept - around) > far_s]] = False
    order = np.flatnonzero(ok)
    if len(order) > 1:
        ok[order[t_s[order] < np.maximum.accumulate(t_s[order])]] = False
    return ok, int(np.sum(~ok))
