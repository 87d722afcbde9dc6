"""The log of a simulated chip and the statistics of its CPU."""

from __future__ import annotations

import ctypes as ct

import numpy as np
from numpy.typing import NDArray

from simavr_bench.core import Core
from simavr_bench.log import RECORD, LogKind, Records, select
from simavr_bench.statistics import CpuLoad, VectorStatistics, vector_statistics


class Observation(Core):
    """Records, load, interrupts, stack."""

    def _log_view(self) -> Records:
        # Valid until the chip runs again: the log may move when it grows.
        count = self._lib.bench_log_count(self.handle)
        if count == 0:
            return np.empty(0, RECORD)
        address = self._lib.bench_log(self.handle)
        raw = (ct.c_uint8 * (count * RECORD.itemsize)).from_address(address)
        return np.frombuffer(raw, RECORD)

    def log(self) -> Records:
        """Copy of all records since the chip was made or the log cleared."""
        return self._log_view().copy()

    def records(self, kind: LogKind, source: int | None = None) -> Records:
        """Copy of the records of one kind and, if given, of one source."""
        return select(self._log_view(), kind, source)

    def clear_log(self) -> None:
        """Forget all records."""
        self._lib.bench_clear_log(self.handle)

    def faults(self) -> list[tuple[int, int, int]]:
        """Cycle, :class:`~simavr_bench.log.Fault` and detail of everything outside the model."""
        chosen = self.records(LogKind.FAULT)
        return [(int(r["cycle"]), int(r["source"]), int(r["value"])) for r in chosen]

    def log_interrupts(self, on: bool = True) -> None:
        """Record every interrupt entry and return (many records)."""
        self._lib.bench_log_interrupts(self.handle, on)

    def log_marks(self, on: bool = True) -> None:
        """Record every byte the program writes to GPIOR0, 1 or 2 (one cycle of its time each)."""
        self._lib.bench_log_marks(self.handle, on)

    def watch_pc(self, symbol: str | int) -> int:
        """Record every execution of the first instruction of a function, or of one instruction.

        The simulator then goes one instruction at a time, several times slower.

        Parameters
        ----------
        symbol : str or int
            Function in the ELF, or a byte address.

        Returns
        -------
        int
            Source of its :attr:`LogKind.PC` records.
        """
        self._pc_watches += 1
        address = self.symbols[symbol][0] if isinstance(symbol, str) else symbol
        self._lib.bench_watch_pc(self.handle, address, self._pc_watches)
        return self._pc_watches

    def count_cycles(self) -> None:
        """Count the cycles of every instruction from now on; several times slower."""
        self._lib.bench_count_cycles(self.handle)

    def cycles_spent(self) -> NDArray[np.uint64]:
        """Cycles since :meth:`count_cycles`, by the word of flash their instruction stands in.

        Entering an interrupt counts where its vector stands.
        """
        words = self._flash_size // 2
        return np.ctypeslib.as_array(self._lib.bench_spent(self.handle), (words,)).copy()

    def load_now(self) -> CpuLoad:
        """CPU cycles by state since the start or :meth:`clear_statistics`."""
        counts = (ct.c_uint64 * 3)()
        self._lib.bench_load(self.handle, counts)
        return CpuLoad(running=counts[0], sleeping=counts[1], held=counts[2])

    def interrupt(self, vector: int) -> VectorStatistics:
        """Latency and length of one vector since the last :meth:`clear_statistics`."""
        return vector_statistics(self._lib.bench_vector(self.handle, vector).contents)

    def clear_statistics(self) -> None:
        """Start load, interrupt and stack statistics again."""
        self._lib.bench_clear_statistics(self.handle)

    @property
    def lowest_sp(self) -> int:
        """Lowest stack pointer seen at interrupt entries and between bursts of instructions."""
        return int(self._lib.bench_lowest_sp(self.handle))

    @property
    def sp(self) -> int:
        """Stack pointer now."""
        return int(self._lib.bench_sp(self.handle))

    @property
    def pc(self) -> int:
        """Program counter now, in bytes."""
        return int(self._lib.bench_pc(self.handle))
