"""How long the turns of a program's main loop are."""

from __future__ import annotations

import ctypes as ct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simavr_bench.chip import Chip

_BINS = 1 << 16
_CYCLES_PER_US = 16


class _Record(ct.Structure):
    """``loop_stats`` of shim/loop_probe.c, as far as it is read."""

    _fields_ = (
        ("turns", ct.c_uint64),
        ("period_max", ct.c_uint64),
        ("work_max", ct.c_uint64),
        ("period", ct.c_uint32 * _BINS),
        ("work", ct.c_uint32 * _BINS),
    )


@dataclass(frozen=True, slots=True)
class LoopTimes:
    """Turns of the main loop.

    Attributes
    ----------
    turns : int
        Whole turns.
    period_p50_us, period_p99_us, period_max_us : float
        From the end of one sleep to the end of the next, in microseconds; percentiles to 1 us.
    work_p50_us, work_p99_us, work_max_us : float
        The part of it before the sleep.
    """

    turns: int
    period_p50_us: float
    period_p99_us: float
    period_max_us: float
    work_p50_us: float
    work_p99_us: float
    work_max_us: float


class LoopProbe:
    """Watches the main loop of a program that sleeps once a turn, setting and clearing SE.

    Parameters
    ----------
    chip : Chip
        The chip; the probe goes with it.
    """

    def __init__(self, chip: Chip) -> None:
        probe = chip.library.bench_loop_probe
        probe.restype = ct.POINTER(_Record)
        probe.argtypes = [ct.c_void_p]
        self._record = probe(chip.handle)

    def clear(self) -> None:
        """Start the statistics again."""
        ct.memset(self._record, 0, ct.sizeof(_Record))

    def times(self) -> LoopTimes:
        """Give the statistics since the start or :meth:`clear`."""
        record = self._record.contents
        period = np.array(record.period, np.uint32)
        work = np.array(record.work, np.uint32)
        return LoopTimes(
            turns=record.turns,
            period_p50_us=_percentile_us(period, 50),
            period_p99_us=_percentile_us(period, 99),
            period_max_us=record.period_max / _CYCLES_PER_US,
            work_p50_us=_percentile_us(work, 50),
            work_p99_us=_percentile_us(work, 99),
            work_max_us=record.work_max / _CYCLES_PER_US,
        )


def _percentile_us(bins: NDArray[np.uint32], percent: float) -> float:
    total = int(bins.sum())
    if total == 0:
        return 0.0
    # upper end of the bin
    return float(np.searchsorted(np.cumsum(bins), np.ceil(total * percent / 100.0)) + 1)
