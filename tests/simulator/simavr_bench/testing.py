"""What the simulator's tests share."""

from __future__ import annotations

from typing import Protocol

from simavr_bench.chip import Chip, cycles


class MakeChip(Protocol):
    """Makes a chip that runs a program of ``programs/`` and closes it after the test."""

    def __call__(
        self, program: str, *, power: bool = True, seed: int = 1, startup_s: float = 0.0
    ) -> Chip:
        """Make one."""


def run_until_value(chip: Chip, symbol: str, value: int, *, limit_s: float = 3.0) -> None:
    """Run until a variable has a value.

    Raises
    ------
    AssertionError
        If it has not after ``limit_s`` of simulated time.
    """
    end = chip.cycle + cycles(limit_s)
    while chip.read(symbol) != value:
        if chip.cycle >= end:
            raise AssertionError(
                f"{symbol} is {chip.read(symbol)} after {limit_s} s, expected {value}; "
                f"pc {chip.pc:#x}"
            )
        chip.run_s(1e-4)
