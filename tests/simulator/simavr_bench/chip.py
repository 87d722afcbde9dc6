"""One simulated ATmega2560 or ATmega328P."""

from __future__ import annotations

from collections.abc import Iterable

from simavr_bench.buses import BusAccess
from simavr_bench.core import CYCLES_PER_S, ResetCause, cycles
from simavr_bench.memory import MemoryAccess
from simavr_bench.pin_access import PinAccess

__all__ = ["CYCLES_PER_S", "Chip", "ResetCause", "cycles", "run_together"]


class Chip(PinAccess, BusAccess, MemoryAccess):
    """A chip at 16 MHz with nothing connected.

    Several may live in one process; each is independent and, with its seed and stimuli, repeats
    itself to the cycle.

    Parameters
    ----------
    seed : int
        Seeds what the chip does not define: SRAM at power-on, converter noise.
    startup_s : float
        From the release of reset to the first instruction; 66.024 ms is low fuse 0xFF.
    bootloader : bool
        Start in the boot section (BOOTRST programmed) instead of at 0.
    model : str
        ``atmega2560`` or ``atmega328p``.

    Examples
    --------
    >>> with Chip() as chip:
    ...     chip.power_on()
    ...     chip.run_s(0.1)
    ...     round(chip.time_s, 3)
    0.1
    """


def run_together(chips: Iterable[Chip], time_s: float, slice_s: float = 1e-3) -> None:
    """Run several chips side by side in slices of simulated time."""
    every = list(chips)
    ends = [chip.cycle + cycles(time_s) for chip in every]
    while any(chip.cycle < end for chip, end in zip(every, ends, strict=True)):
        for chip, end in zip(every, ends, strict=True):
            chip.run_until(min(end, chip.cycle + cycles(slice_s)))
