"""Pins of a simulated chip, from outside."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simavr_bench.log import LogKind
from simavr_bench.observation import Observation
from simavr_bench.pins import pin_number


class PinAccess(Observation):
    """Drive, pull, watch."""

    def watch(self, *names: str) -> None:
        """Log every level change of these pins."""
        for name in names:
            self._watched.add(pin_number(name))
            self._set_watch(pin_number(name))

    def on_pin(self, name: str, listener: Callable[[bool, int], None]) -> None:
        """Call ``listener(level, cycle)`` at every level change of a pin."""
        self._pin_listeners.setdefault(pin_number(name), []).append(listener)
        self._set_watch(pin_number(name))

    def _set_watch(self, number: int) -> None:
        self._lib.bench_pin_watch(
            self.handle, number, number in self._watched, number in self._pin_listeners
        )

    def level(self, name: str) -> bool:
        """Level of a pin now."""
        return bool(self._lib.bench_pin_level(self.handle, pin_number(name)))

    def is_output(self, name: str) -> bool:
        """Whether the chip drives the pin now."""
        return bool(self._lib.bench_pin_driven(self.handle, pin_number(name)))

    def drive(self, name: str, level: bool | None, *, at_cycle: int | None = None) -> None:
        """Drive a pin from outside, or let it go (``None``), now or at a cycle."""
        drive = 0 if level is None else 2 if level else 1
        if at_cycle is None:
            self._lib.bench_pin_strong(self.handle, pin_number(name), drive)
        else:
            self._lib.bench_pin_strong_at(self.handle, at_cycle, pin_number(name), drive)

    def pull(self, name: str, level: bool | None) -> None:
        """Connect an external pull-up (true), pull-down (false) or nothing (none)."""
        weak = 0 if level is None else 2 if level else 1
        self._lib.bench_pin_weak(self.handle, pin_number(name), weak)

    def edges(self, name: str) -> tuple[NDArray[np.uint64], NDArray[np.uint32]]:
        """Edges of a watched pin.

        Returns
        -------
        cycles : NDArray[np.uint64], shape (n,)
            When.
        levels : NDArray[np.uint32], shape (n,)
            Level from then on.
        """
        chosen = self.records(LogKind.PIN, pin_number(name))
        return chosen["cycle"], chosen["value"]
