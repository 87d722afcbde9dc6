"""Figures of merit of a run: CPU load, interrupt latency and length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simavr_bench.library import LATENCY_BINS, VectorRecord


@dataclass(frozen=True, slots=True)
class CpuLoad:
    """Cycles by state of the CPU."""

    running: int
    sleeping: int
    held: int

    @property
    def busy_fraction(self) -> float:
        """Part of the cycles out of reset in which the CPU executed, 0..1."""
        total = self.running + self.sleeping
        return self.running / total if total else 0.0


@dataclass(frozen=True, slots=True)
class VectorStatistics:
    """One interrupt vector.

    Attributes
    ----------
    count : int
        Entries.
    latency_p50, latency_p99, latency_max : int
        Cycles from the request to the first instruction at the vector.
    length_p50, length_p99, length_max : int
        Cycles from there to the end of RETI, nested interrupts included.
    nested_max : int
        Deepest nesting at an entry, itself counted.

    Percentiles are exact below 4096 cycles and read 4095 above.
    """

    count: int
    latency_p50: int
    latency_p99: int
    latency_max: int
    length_p50: int
    length_p99: int
    length_max: int
    nested_max: int


def _percentile(bins: NDArray[np.uint32], percent: float) -> int:
    total = int(bins.sum())
    if total == 0:
        return 0
    return int(np.searchsorted(np.cumsum(bins), np.ceil(total * percent / 100.0)))


def vector_statistics(record: VectorRecord) -> VectorStatistics:
    """Reduce the bins of one vector to percentiles."""
    latency = np.array(record.latency, np.uint32).reshape(LATENCY_BINS)
    length = np.array(record.length, np.uint32).reshape(LATENCY_BINS)
    return VectorStatistics(
        count=record.count,
        latency_p50=_percentile(latency, 50),
        latency_p99=_percentile(latency, 99),
        latency_max=record.latency_max,
        length_p50=_percentile(length, 50),
        length_p99=_percentile(length, 99),
        length_max=record.length_max,
        nested_max=record.nested_max,
    )
