"""Memories of a simulated chip, looked at from outside."""

from __future__ import annotations

import ctypes as ct
import struct

import numpy as np
from numpy.typing import NDArray

from simavr_bench.core import Core


class MemoryAccess(Core):
    """Data space, EEPROM, flash, variables by name."""

    def data(self, address: int, count: int) -> bytes:
        """Bytes of the data space (registers, I/O without side effects, SRAM)."""
        return ct.string_at(self._lib.bench_data(self.handle) + address, count)

    def poke(self, address: int, value: bytes) -> None:
        """Write bytes of the data space without side effects."""
        ct.memmove(self._lib.bench_data(self.handle) + address, value, len(value))

    def eeprom(self) -> bytes:
        """All bytes of EEPROM."""
        return ct.string_at(self._lib.bench_eeprom(self.handle), self._eeprom_size)

    def set_eeprom(self, content: bytes) -> None:
        """Set all bytes of EEPROM.

        Raises
        ------
        ValueError
            If there are not as many as the chip has.
        """
        if len(content) != self._eeprom_size:
            raise ValueError(f"EEPROM of {len(content)} bytes, expected {self._eeprom_size}")
        ct.memmove(self._lib.bench_eeprom(self.handle), content, self._eeprom_size)

    def flash(self, address: int, count: int) -> bytes:
        """Bytes of program memory."""
        return ct.string_at(self._lib.bench_flash(self.handle) + address, count)

    def read(self, symbol: str, form: str = "") -> int:
        """Read an integer variable by name.

        Parameters
        ----------
        symbol : str
            Name in the ELF.
        form : str
            struct format without byte order; by default unsigned of the symbol's size.

        Returns
        -------
        int
            Its value now.

        Raises
        ------
        KeyError
            If the ELF has no such symbol.
        """
        address, size = self.symbols[symbol]
        raw = self.data(address, struct.calcsize("<" + form) if form else size)
        return int(struct.unpack("<" + form, raw)[0] if form else int.from_bytes(raw, "little"))

    def read_array(self, symbol: str, dtype: str) -> NDArray[np.generic]:
        """Read an array variable by name as numpy ``dtype`` (little-endian)."""
        address, size = self.symbols[symbol]
        return np.frombuffer(self.data(address, size), dtype)

    def untouched_stack(self, first: int, before: bytes) -> int:
        """Bytes from ``first`` upwards that still are as in ``before``.

        Parameters
        ----------
        first : int
            Lowest address the stack may use (``_end`` or the end of ``.noinit``).
        before : bytes
            Memory from ``first``, taken when nothing had run there.

        Returns
        -------
        int
            Length of the run of unchanged bytes.
        """
        now = np.frombuffer(self.data(first, len(before)), np.uint8)
        changed = np.flatnonzero(now != np.frombuffer(before, np.uint8))
        return int(changed[0]) if len(changed) else len(before)
