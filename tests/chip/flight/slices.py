"""How long a function of the image takes, from call to return, without interrupts."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from simavr_bench import Chip
from simavr_bench.log import LogKind

_CALL = re.compile(
    r"^ *([0-9a-f]+):\t(?:[0-9a-f]{2} )+ *\t(r?call|r?jmp)\t"
    r"(?:0x|\.[+-]\d+ *\t; 0x)([0-9a-f]+)"
)


class SliceWatch:
    """Notes each call of a function and its return, and every interrupt.

    Parameters
    ----------
    chip : Chip
    elf : Path
    name : str
        A part of the function's mangled name; the linker may lengthen it.
    """

    def __init__(self, chip: Chip, elf: Path, name: str) -> None:
        self._chip = chip
        found = {place[0] for symbol, place in chip.symbols.items() if name in symbol}
        if len(found) != 1:
            raise KeyError(f"{len(found)} functions named {name} in the image, expected 1")
        function = found.pop()
        self._entry = chip.watch_pc(function)
        self._returns = [chip.watch_pc(address) for address in _behind_calls(elf, function)]
        chip.log_interrupts()

    def cycles(self) -> NDArray[np.int64]:
        """Return the length of each call so far."""
        marks = self._chip.records(LogKind.PC)
        turns = self._chip.records(LogKind.INTERRUPT)
        depth = np.cumsum(np.where(turns["value"] == 1, 1, -1))
        began = turns["cycle"][(turns["value"] == 1) & (depth == 1)].astype(np.int64)
        ended = turns["cycle"][depth == 0].astype(np.int64)
        count = min(len(began), len(ended))
        began, spent = began[:count], np.cumsum(ended[:count] - began[:count])
        lengths, entered = [], -1
        for mark in marks:
            at = int(mark["cycle"])
            if int(mark["source"]) == self._entry:
                entered = at
            elif int(mark["source"]) in self._returns and entered >= 0:
                first, last = np.searchsorted(began, [entered, at])
                before = spent[first - 1] if first else 0
                inside = spent[last - 1] - before if last > first else 0
                lengths.append(at - entered - int(inside))
                entered = -1
        return np.array(lengths, dtype=np.int64)


def _behind_calls(elf: Path, function: int) -> list[int]:
    listing = subprocess.run(
        ["avr-objdump", "-d", str(elf)], capture_output=True, text=True, check=True
    ).stdout
    found = []
    for line in listing.splitlines():
        call = _CALL.match(line)
        if call is None or int(call[3], 16) != function:
            continue
        if not call[2].endswith("call"):
            raise KeyError(f"{call[1]}: jumps to the function, and its return is another's")
        found.append(int(call[1], 16) + (4 if call[2] == "call" else 2))
    return found
