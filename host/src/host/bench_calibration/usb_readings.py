"""Held positions read over USB: somebody sets them, the logger sends the readings."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.held_position import Held
from host.bench_calibration.raw_channel import raw_channel
from host.bench_calibration.typed_readings import TypedSource
from host.bench_calibration.usb_channels import UsbChannels
from host.physical.timebase import WRAP_US

ROWS = 40  # 2 s, as the procedures hold
LEAK_ROWS = 1200  # a minute
_ON_ITS_WAY = 5  # rows dropped after Enter: they were measured before it and still in buffers
_PARTS = 3  # parts of a reading whose means must agree
_MOVED = 0.25  # share of the smallest step between positions by which parts may differ
_SHOWN_S = 0.2

Ask = Callable[[str], str]
Say = Callable[[str], None]


class UsbSource(TypedSource):
    """Held positions of one channel, each read behind an Enter.

    Parameters
    ----------
    channels : UsbChannels
        Channels of the open port.
    subject, channel, positions, ask, say
        As `TypedSource` has them.
    first_repeat : int
    show : callable, optional
        Takes the question with the value as it is now, five times a second while it waits.
    """

    asks = "Enter"

    def __init__(
        self,
        channels: UsbChannels,
        subject: Subject,
        channel: str,
        positions: Sequence[float],
        ask: Ask,
        say: Say,
        first_repeat: int = 1,
        show: Say | None = None,
    ) -> None:
        super().__init__(subject, channel, positions, self._shown(ask), say)
        self._channels, self._first, self._show = channels, first_repeat, show
        self._prefix = "rc_" if subject.table == "pulse" else ""
        steps = np.abs(np.diff(positions))
        slope = subject.limits["slope"][1]
        self._least = _MOVED * float(steps[steps > 0.0].min(initial=np.inf)) / slope

    def held(self) -> list[Held]:
        """Ask for every position; of a pitot first for a minute's pressure, which shows a leak.

        Raises
        ------
        UsageError
            If nothing was read; DeviceError if the port goes away or falls silent.
        """
        return [*self._leak(), *super().held()]

    def read(self, line: str, repeat: int, position: float) -> Held | None:
        """Average two seconds of rows; None if the channel moved or was not valid."""
        held = self._read(ROWS, repeat, position)
        if held is None:
            return None
        if held.change[self._channel] * held.duration_s > self._least:
            self._say("  it moved while it was read; again")
            return None
        self._say(f"  {held.readings[self._channel]:.2f} +- {held.noise[self._channel]:.2f}")
        return Held(
            held.moved, held.repeat, position, held.readings, held.noise, {}, held.duration_s
        )

    def _leak(self) -> list[Held]:
        if "leak" not in self._subject.limits:
            return []
        far = max(self._positions, key=abs)
        unit = self._subject.tool.setting if self._subject.tool is not None else ""
        answer = self._ask(f"{self._channel}: set {far:+g} {unit}, Enter and hold for 60 s? ")
        held = self._read(LEAK_ROWS, 1, far) if answer else None
        return [held] if held is not None else []

    def _read(self, count: int, repeat: int, position: float) -> Held | None:
        """Return means, noise and trends of rows that come now; None where it is not valid."""
        schema, rows = self._channels.next_rows(_ON_ITS_WAY + count)
        rows = rows[_ON_ITS_WAY:]
        t_s = ((rows["t_us"].astype(np.int64) - int(rows["t_us"][0])) % WRAP_US) * 1e-6
        readings, noise, change = {}, {}, {}
        for name in self._subject.channels:
            raw = raw_channel(schema, rows, self._prefix + name)
            good = np.isfinite(raw)
            if good.sum() < count // 2:
                continue
            trend = np.polyfit(t_s[good], raw[good], 1)
            parts = [float(part.mean()) for part in np.array_split(raw[good], _PARTS)]
            readings[name] = float(raw[good].mean())
            noise[name] = float(np.std(raw[good] - np.polyval(trend, t_s[good])))
            moved = np.ptp(parts) / t_s[-1]
            change[name] = float(trend[0]) if count == LEAK_ROWS else float(moved)
        if self._channel not in readings:
            self._say(f"  {self._channel} is not valid; is it plugged in? again")
            return None
        number = repeat + self._first - 1
        return Held(self._channel, number, position, readings, noise, change, float(t_s[-1]))

    def _shown(self, ask: Ask) -> Ask:
        """Return a function that asks with the present value by the question while it waits."""

        def asked(question: str) -> str:
            last_s = 0.0

            def seen() -> None:
                nonlocal last_s
                if self._show is not None and time.monotonic() - last_s > _SHOWN_S:
                    last_s = time.monotonic()
                    value = self._channels.newest(self._prefix + self._channel)
                    self._show(f"{question}[{value:7.1f}] ")

            self._channels.seen = seen
            try:
                return ask(question)
            finally:
                self._channels.seen = None

        return asked
