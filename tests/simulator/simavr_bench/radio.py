"""An XBee on a UART: takes bytes as they come, sends what the air lets through.

Digi XBee-PRO S2B: 202 bytes of serial buffer, CTS released with 17 left, at best 35 kbit/s of
payload between two nodes without encryption.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from simavr_bench.chip import Chip, cycles

BUFFER_BYTES = 202
CTS_ROOM_BYTES = 17


@dataclass(slots=True)
class XBee:
    """A radio in transparent mode.

    Parameters
    ----------
    chip : Chip
        What talks to it.
    port : int
        On which UART.
    air_bps : float
        Payload the air takes; 0 is a dead link.
    cts : str or None
        Pin it holds low while it has room.

    Attributes
    ----------
    delivered : bytearray
        What the ground heard.
    lost : int
        Bytes that found the buffer full.
    """

    chip: Chip
    port: int
    air_bps: float = 35_000.0
    cts: str | None = None
    delivered: bytearray = field(default_factory=bytearray)
    lost: int = 0
    _buffer: bytearray = field(default_factory=bytearray)
    _sending: bool = False

    def start(self) -> XBee:
        """Switch it on; gives itself."""
        self.chip.on_uart(self.port, self._byte)
        self._show_cts()
        return self

    def _byte(self, byte: int, cycle: int) -> None:
        if len(self._buffer) >= BUFFER_BYTES:
            self.lost += 1
            return
        self._buffer.append(byte)
        self._show_cts()
        self._send()

    def _send(self) -> None:
        if self._sending or not self._buffer or self.air_bps <= 0.0:
            return
        self._sending = True
        self.chip.at(self.chip.cycle + cycles(8.0 / self.air_bps), self._sent)

    def _sent(self) -> None:
        self._sending = False
        self.delivered.append(self._buffer.pop(0))
        self._show_cts()
        self._send()

    def _show_cts(self) -> None:
        if self.cts is not None:
            self.chip.drive(self.cts, len(self._buffer) > BUFFER_BYTES - CTS_ROOM_BYTES)
