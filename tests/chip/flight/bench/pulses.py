"""Judge pulses: what the receiver sent, what the firmware measured, what the servos were sent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CYCLES_PER_US = 16
CYCLES_PER_TICK = 8
NEWEST_CYCLES = 300 * CYCLES_PER_US  # the firmware accepts a pulse 300 us behind its end at first
OLDEST_CYCLES = 100_000 * CYCLES_PER_US
SAME_CYCLES = 1 * CYCLES_PER_US

Cycles = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Measured:
    """Pulses of one channel with what the firmware made of them.

    Attributes
    ----------
    start, end : NDArray[np.int64], shape (n,)
        Cycles of the receiver's pulses.
    width_ticks : NDArray[np.int64], shape (n,)
        What the firmware measured; 0: not accepted.
    """

    start: Cycles
    end: Cycles
    width_ticks: Cycles

    @property
    def error_us(self) -> NDArray[np.float64]:
        """Measured minus true width of every accepted pulse."""
        ok = self.width_ticks > 0
        true = (self.end - self.start)[ok]
        error: NDArray[np.float64] = (self.width_ticks[ok] * CYCLES_PER_TICK - true) / CYCLES_PER_US
        return error


def match_measured(sent: Cycles, accepted: Cycles, clock_zero: int) -> Measured:
    """Find the receiver's pulse behind every accepted one by the time of its rise.

    Parameters
    ----------
    sent : NDArray[np.int64], shape (n, 2)
        First and last cycle of the pulses of one channel.
    accepted : NDArray[np.int64], shape (m, 2)
        Ticks of the firmware's clock at the rise, modulo 2**32; width in ticks.
    clock_zero : int
        Cycle at which that clock showed 0.

    Raises
    ------
    ValueError
        If the firmware accepted a pulse that nobody sent.
    """
    start, end = sent[:, 0], sent[:, 1]
    width = np.zeros(len(sent), np.int64)
    if len(accepted):
        turn = (1 << 32) * CYCLES_PER_TICK
        rise = clock_zero + accepted[:, 0] * CYCLES_PER_TICK
        rise += (start[0] - rise[0] + turn // 2) // turn * turn
        after = np.clip(np.searchsorted(start, rise), 1, len(start) - 1)
        nearer = rise - start[after - 1] < start[after] - rise
        pulse = after - nearer
        far = np.abs(rise - start[pulse]) > 50 * CYCLES_PER_US
        if np.any(far):
            raise ValueError(f"the firmware accepted {np.count_nonzero(far)} pulses nobody sent")
        width[pulse] = accepted[:, 1]
    return Measured(start, end, width)


@dataclass(frozen=True, slots=True)
class Output:
    """Servo pulses of one channel against the measured ones they should repeat.

    Attributes
    ----------
    width_error_us : NDArray[np.float64], shape (n,)
        Error of every servo pulse against the nearest width accepted in the last 100 ms.
    strange : int
        Servo pulses that are not within 1 us of such a width.
    delay_ms : NDArray[np.float64], shape (m,)
        From the end of each accepted pulse to the start of the first servo pulse that repeats it
        or a later one.
    """

    width_error_us: NDArray[np.float64]
    strange: int
    delay_ms: NDArray[np.float64]


def judge_output(pulses: Cycles, measured: Measured) -> Output:
    """Compare servo pulses with what was measured.

    Parameters
    ----------
    pulses : NDArray[np.int64], shape (n, 2)
        First and last cycle of the servo pulses, rising.
    measured : Measured
        The same channel of the receiver, from at least 100 ms before the first servo pulse.
    """
    ok = measured.width_ticks > 0
    ends, widths = measured.end[ok], measured.width_ticks[ok] * CYCLES_PER_TICK
    repeats = np.full(len(pulses), -1, np.int64)
    errors = np.full(len(pulses), np.inf)
    for number, (start, end) in enumerate(pulses):
        first = np.searchsorted(ends, start - OLDEST_CYCLES)
        last = np.searchsorted(ends, start - NEWEST_CYCLES, side="right")
        if first == last:
            continue
        error = np.abs(widths[first:last] - (end - start))
        errors[number] = error.min()
        same = np.flatnonzero(error <= SAME_CYCLES)
        if len(same):
            repeats[number] = first + same[-1]  # of equal widths the younger
    newest = np.maximum.accumulate(repeats) if len(repeats) else repeats
    shown = np.searchsorted(newest, np.arange(len(ends)))
    # The first pulses may have been repeated before the record begins, the last behind its end.
    begin = newest[0] if len(newest) else 0
    whole = (shown < len(pulses)) & (np.arange(len(ends)) > begin)
    delay = (pulses[shown[whole], 0] - ends[whole]) / (1000 * CYCLES_PER_US)
    return Output(errors / CYCLES_PER_US, int(np.count_nonzero(repeats < 0)), delay)
