"""Look into the firmware's memory while it flies: what it measured, when its schema returns."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from flight.bench.plan import CYCLES_PER_S, RECOVERY_S, STALL_S, Stall
from numpy.typing import NDArray
from owners import find_member
from simavr_bench import Chip, SdCard

CHANNELS = 5
CYCLES_PER_TICK = 8
_TURN_CYCLES = 0x10000 * CYCLES_PER_TICK
_MILLISECOND = CYCLES_PER_S // 1000


def find_symbol(chip: Chip, name: str) -> int:
    """Address of a variable of the image by a part of its name, which the linker may lengthen."""
    found = {address for symbol, (address, _) in chip.symbols.items() if name in symbol}
    if len(found) != 1:
        raise KeyError(f"{len(found)} variables named {name} in the image, expected 1")
    return found.pop() & 0xFFFF


def read_word(chip: Chip, elf: Path, path: str) -> int:
    """Two bytes of the instrument's memory, a member named as in its class."""
    place = find_member(elf, "Instrument", path).offset
    address = find_symbol(chip, "g_instrument") + place
    return int.from_bytes(chip.data(address, 2), "little")


def clock_zero(chip: Chip) -> int:
    """Cycle at which the firmware's clock showed 0, within 60 cycles; runs the chip 65 ms at most.

    The turns of timer 5 are counted by its overflow interrupt: the counter in RAM changes some
    20 to 60 cycles behind each overflow.
    """
    turns = find_symbol(chip, "clock_turns")
    before = chip.data(turns, 3)
    while chip.data(turns, 3) == before:
        chip.run_until(chip.cycle + 16)
    low, high = struct.unpack("<HB", chip.data(turns, 3))
    counted: int = (high << 16) + low
    return chip.cycle - 40 - counted * _TURN_CYCLES


class ReceiverWatch:
    """Notes every pulse the firmware accepts, once a millisecond.

    Attributes
    ----------
    accepted : list of tuple(int, int, int, int)
        Input, cycle of the look that found it, ticks of its rise, width in ticks.
    """

    def __init__(self, chip: Chip, elf: Path) -> None:
        inputs = find_member(elf, "Instrument", "pilot_.decoder_.inputs_")
        self._chip = chip
        self._address = find_symbol(chip, "g_instrument") + inputs.offset
        self._size, self._stride = inputs.size, inputs.stride
        self._rise, self._width = inputs.fields["accepted"][0], inputs.fields["width"][0]
        self._last = [b""] * CHANNELS
        self._changed = [False] * CHANNELS
        self._on = False
        self.accepted: list[tuple[int, int, int, int]] = []

    def start(self) -> None:
        """Look from now on."""
        self._on = True
        self._look()

    def stop(self) -> None:
        """Look no more."""
        self._on = False

    def _look(self) -> None:
        if not self._on:
            return
        now = self._chip.cycle
        self._chip.at(now + _MILLISECOND, self._look)
        memory = self._chip.data(self._address, self._size)
        for channel in range(CHANNELS):
            first = channel * self._stride
            rise = memory[first + self._rise : first + self._rise + 4]
            if rise != self._last[channel]:
                # Perhaps half written: its content at the next look counts.
                self._last[channel] = rise
                self._changed[channel] = True
            elif self._changed[channel]:
                self._changed[channel] = False
                at = first + self._width
                (width,) = struct.unpack("<H", memory[at : at + 2])
                if width != 0:
                    self.accepted.append((channel, now, struct.unpack("<I", rise)[0], width))

    def rows(self) -> NDArray[np.int64]:
        """All of them, shape (n, 4), columns as in :attr:`accepted`."""
        return np.array(self.accepted, np.int64).reshape(-1, 4)


class StallScript:
    """Makes the card stall as planned, and once in every return of the schema besides.

    Parameters
    ----------
    chip, card : Chip, SdCard
        The instrument's.
    elf : Path
        Its image: whether the schema is on its way is read from the firmware's memory.
    rate_hz : int
        Rate of the logger; decides how long a stall is.
    planned : sequence of Stall
        By rising cycle.

    Attributes
    ----------
    made : list of int
        Cycles from which the next block accepted stalls.
    in_schema : int
        How many of them came while the schema was on its way.
    """

    _LOOK_S = 0.005
    _PIECES = (3, 12)  # blocks of 476 B: the middle of a pass

    def __init__(
        self, chip: Chip, card: SdCard, elf: Path, rate_hz: int, planned: Sequence[Stall]
    ) -> None:
        offset = find_member(elf, "Instrument", "recorder_.writer_.schema_offset_")
        self._chip, self._card = chip, card
        self._address = find_symbol(chip, "g_instrument") + offset.offset
        self._length_s = STALL_S[rate_hz]
        self._free = 0  # the next stall not before this cycle
        self._in_pass = False
        self.made: list[int] = []
        self.in_schema = 0
        for stall in planned:
            chip.at(stall.cycle, partial(self._begin, reject=stall.reject))
        self._look()

    def _begin(self, *, reject: bool = False) -> None:
        now = self._chip.cycle
        if now < self._free:
            self._chip.at(self._free, partial(self._begin, reject=reject))
            return
        if reject:
            self._card.reject(at_cycle=now)
        self._card.stall(self._length_s, at_cycle=now)
        self.made.append(now)
        self.in_schema += self._schema_on_its_way()
        self._free = now + round((self._length_s + RECOVERY_S) * CYCLES_PER_S)

    def _look(self) -> None:
        self._chip.at(self._chip.cycle + round(self._LOOK_S * CYCLES_PER_S), self._look)
        in_pass = self._schema_on_its_way()
        if in_pass and not self._in_pass and self._chip.cycle >= self._free:
            self._begin()
        self._in_pass = in_pass

    def _schema_on_its_way(self) -> bool:
        (offset,) = struct.unpack("<H", self._chip.data(self._address, 2))
        first, last = (number * 476 for number in self._PIECES)
        return bool(first <= offset <= last)
