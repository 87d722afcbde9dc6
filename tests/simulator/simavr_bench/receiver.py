"""An RC receiver: one line per channel, pulses every frame, lost, held or disturbed on request."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simavr_bench.chip import Chip, cycles


@dataclass(slots=True)
class Receiver:
    """Pulses on receiver lines.

    Parameters
    ----------
    chip : Chip
        Whose pins it drives.
    pins : sequence of str
        One per channel, in the receiver's order.
    frame_s : float
        Frame time, 14 to 22.5 ms in the field.
    sequential : bool
        One channel after the other as a PPM receiver does, else all at once.
    gap_us : float
        Between channels of a sequential receiver.
    jitter_us : float
        Each pulse's width varies uniformly by this much, plus and minus.
    seed : int
        For jitter and glitches.

    Attributes
    ----------
    width_us : list of float
        What the sticks say; change it while the simulation runs.
    source : callable or None
        Gives the widths for a time in seconds, in place of ``width_us``.
    lost : bool
        No pulses at all, lines low.
    lost_channels : set of int
        Channels without pulses.
    sent : list of tuple(int, int, int)
        Channel, first and last cycle of every whole pulse.
    """

    chip: Chip
    pins: Sequence[str]
    frame_s: float = 0.020
    sequential: bool = True
    gap_us: float = 0.0
    jitter_us: float = 0.0
    seed: int = 1
    width_us: list[float] = field(default_factory=list)
    source: Callable[[float], Sequence[float]] | None = None
    lost: bool = False
    lost_channels: set[int] = field(default_factory=set)
    sent: list[tuple[int, int, int]] = field(default_factory=list)
    _rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        """Put all lines low."""
        if not self.width_us:
            self.width_us = [1500.0] * len(self.pins)
        self._rng = np.random.default_rng(self.seed)
        for pin in self.pins:
            self.chip.drive(pin, False)

    def start(self, *, at_cycle: int | None = None) -> Receiver:
        """Send frames from a cycle on (now by default); gives itself."""
        self.chip.at(self.chip.cycle if at_cycle is None else at_cycle, self._frame)
        return self

    def _frame(self) -> None:
        start = self.chip.cycle
        self.chip.at(start + cycles(self.frame_s), self._frame)
        if self.lost:
            return
        widths = self.width_us if self.source is None else self.source(start / 16e6)
        at = start
        for channel, (pin, width) in enumerate(zip(self.pins, widths, strict=True)):
            jitter = self._rng.uniform(-self.jitter_us, self.jitter_us) if self.jitter_us else 0.0
            length = round((width + jitter) * 16)
            if channel not in self.lost_channels:
                self.chip.drive(pin, True, at_cycle=at)
                self.chip.drive(pin, False, at_cycle=at + length)
                self.sent.append((channel, at, at + length))
            if self.sequential:
                at += length + round(self.gap_us * 16)

    def glitch(self, channel: int, *, at_cycle: int, width_us: float) -> None:
        """Add one disturbance: the line high for a time, whatever the frame does."""
        self.chip.drive(self.pins[channel], True, at_cycle=at_cycle)
        self.chip.drive(self.pins[channel], False, at_cycle=at_cycle + round(width_us * 16))

    def noise(self, channel: int, *, at_cycle: int, time_s: float, rate_hz: float) -> int:
        """Add a burst of square noise; gives the number of edges."""
        half = round(16e6 / rate_hz / 2)
        edges = int(time_s * rate_hz) * 2
        for k in range(edges):
            self.chip.drive(self.pins[channel], k % 2 == 0, at_cycle=at_cycle + k * half)
        return edges

    def pulses(self, channel: int) -> NDArray[np.int64]:
        """Start and end cycle of the pulses sent on a channel, shape (n, 2)."""
        rows = [(start, end) for number, start, end in self.sent if number == channel]
        return np.array(rows, np.int64).reshape(-1, 2)
