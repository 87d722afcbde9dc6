"""How a column was sampled: the step of its numbers, and how many rows each value stays.

A logger that writes every sensor in every row repeats the last value of a slow one. A quantised
value repeats too, but at no regular rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray

FEWEST = 32
SAME = 1e-6  # of the range: values nearer to each other are one, up to rounding of a unit
WHOLE = 0.05  # of a step: how far from a whole number of them values may lie
COARSE = 0.5  # more different values than this share of the rows: the step is below the noise
AT_ROWS = 0.95  # of the changes happen at rows of one hold
RUN_SHARE, RUN_SPREAD = 0.7, 0.2  # of the runs are as long as the median, to this share of it
LONGEST_HOLD = 100
REPEATED_SHARE = 0.5  # of the rows between samples that have a value, of a hold


@dataclass(frozen=True, slots=True)
class Sampling:
    """Sampling of one column: the step of its numbers (0: none is seen), rows each value stays (1:
    not held), and at which rows it was sampled."""

    step: float
    hold: int
    sampled: BoolArray


def sampled_name(name: str) -> str:
    """Return the name of the column that is one where another was sampled, zero between."""
    return f"{name} sampled"


def sampling_of(values: Array) -> Sampling:
    """Return step and hold of a column of (n,) values; a missing one breaks no hold."""
    whole = _filled(values)
    found = _sampling_of_whole(whole, quantum(values))
    # Rows of a slow sensor that are empty in between repeat nothing.
    repeated = np.isfinite(values[~found.sampled])
    if found.hold > 1 and np.mean(repeated) < REPEATED_SHARE:
        return Sampling(found.step, 1, np.ones(len(values), dtype=bool))
    return found


def _filled(values: Array) -> Array:
    """Return the values, each missing one as the last before it; the first ones as the next."""
    seen = np.isfinite(values)
    if seen.all() or not seen.any():
        return values
    last = np.maximum.accumulate(np.where(seen, np.arange(len(values)), -1))
    return np.asarray(values[np.where(last < 0, int(np.argmax(seen)), last)])


def _sampling_of_whole(values: Array, step: float) -> Sampling:
    every = np.ones(len(values), dtype=bool)
    starts, lengths = runs(values)
    if len(starts) - 2 < FEWEST:
        return Sampling(step, 1, every)
    inner = lengths[1:-1]  # ends are cut
    usual = float(np.median(inner))
    hold, phase = _hold(starts[1:])
    if hold > 1:
        sampled = (np.arange(len(values)) - phase) % hold == 0
        # Now and then a logger writes a value a row late.
        near = sampled | np.roll(sampled, 1) | np.roll(sampled, -1)
        late = np.zeros(len(values), dtype=bool)
        late[starts] = ~near[starts]
        return Sampling(step, hold, sampled | late)
    regular = float(np.mean(np.abs(inner - usual) <= RUN_SPREAD * usual)) >= RUN_SHARE
    if usual >= 2.0 and regular:
        changed = np.zeros(len(values), dtype=bool)
        changed[starts] = True
        return Sampling(step, round(usual), changed)
    return Sampling(step, 1, every)


def quantum(values: Array) -> float:
    """Return the step that the values are whole multiples of; 0 where it is below their noise.

    A uniform step is known noise of variance step^2 / 12 (Widrow & Kollar, Quantization Noise,
    ch. 4).
    """
    seen = values[np.isfinite(values)]
    spread = float(np.ptp(seen)) if len(seen) else 0.0
    if spread == 0.0:
        return 0.0
    different = np.unique(seen)
    between = np.diff(different)
    between = between[between > SAME * spread]
    if len(between) + 1 > COARSE * len(seen) or not len(between):
        return 0.0
    step = float(np.median(between[between < 1.5 * between.min()]))
    multiple = between / step
    whole = np.abs(multiple - np.round(multiple)) < WHOLE * np.maximum(multiple, 1.0)
    return step if float(np.mean(whole)) > AT_ROWS else 0.0


def runs(values: Array) -> tuple[IntArray, IntArray]:
    """Return where equal values begin, and how many of them follow each other."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0]))
    return starts, np.diff(np.append(starts, len(values)))


def _hold(starts: IntArray) -> tuple[int, int]:
    """Return after how many rows values may change, and the first such row; 1 if after any."""
    most = min(LONGEST_HOLD, int(starts[-1] - starts[0]) // FEWEST)
    apart = np.bincount(np.diff(starts))
    for hold in range(most, 1, -1):
        # Where so many begin at rows of one hold, all but twice the rest are whole holds apart.
        if apart[::hold].sum() < len(starts) - 1 - 2.0 * (1.0 - AT_ROWS) * len(starts):
            continue
        count = np.bincount(starts % hold, minlength=hold)
        if count.max() >= AT_ROWS * len(starts):
            return hold, int(np.argmax(count))
    return 1, 0
