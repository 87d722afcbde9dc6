"""A u-blox receiver on a UART: delivered talking NMEA, switched to UBX by whoever asks for it.

u-blox 6 Receiver Description, GPS.G6-SW-10018; NAV-PVT from the u-blox 7 one.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from simavr_bench.chip import Chip, cycles

_UCSRA = (0xC0, 0xC8, 0xD0, 0x130)
GPS_BEGAN = datetime(1980, 1, 6, tzinfo=UTC)
LEAP_S = 18  # since 2017
POSLLH, SOL, PVT, VELNED = (1, 0x02), (1, 0x06), (1, 0x07), (1, 0x12)


def ubx(kind: tuple[int, int], payload: bytes) -> bytes:
    """Frame a UBX message: sync, class, id, length, payload, Fletcher checksum."""
    body = struct.pack("<BBH", *kind, len(payload)) + payload
    a = b = 0
    for byte in body:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return b"\xb5\x62" + body + bytes((a, b))


@dataclass(slots=True)
class GpsUart:
    """A receiver on one port.

    Parameters
    ----------
    chip : Chip
        Whose port it talks to.
    port : int
        0..3.
    baud : int
        What it speaks at first.
    knows_pvt : bool
        u-blox 7 and later; an older one refuses the message.

    Attributes
    ----------
    fix : int
        0 none, 3 three-dimensional.
    latitude_1e7, longitude_1e7, height_mm : int
        Position.
    velocity_cmps : tuple of int
        North, east, down.
    week, itow_ms : int
        GPS time of the next epoch; ``itow_ms`` advances by itself and wraps with the week.
    silent, garbage : bool
        Sends nothing; sends random-looking bytes instead.
    deaf : bool
        Hears nothing: its receive line belongs to another board.
    epochs : list of tuple(int, int)
        Cycle of the first byte and ``itow_ms`` of each epoch sent.
    configured : list of tuple(int, int)
        UBX messages heard, class and id.
    """

    chip: Chip
    port: int
    baud: int = 9600
    knows_pvt: bool = False
    fix: int = 3
    satellites: int = 9
    latitude_1e7: int = 250_500_000
    longitude_1e7: int = 1_215_000_000
    height_mm: int = 30_000
    velocity_cmps: tuple[int, int, int] = (1200, -300, 10)
    week: int = 1_870
    itow_ms: int = 345_600_000
    silent: bool = False
    garbage: bool = False
    deaf: bool = False
    epochs: list[tuple[int, int]] = field(default_factory=list)
    configured: list[tuple[int, int]] = field(default_factory=list)
    enabled: set[tuple[int, int]] = field(default_factory=set)
    period_ms: int = 1000
    nmea: bool = True
    _heard: bytearray = field(default_factory=bytearray)

    def start(self, *, at_cycle: int | None = None) -> GpsUart:
        """Switch it on (now by default); gives itself."""
        self.chip.on_uart(self.port, self._byte)
        self.chip.at(self.chip.cycle if at_cycle is None else at_cycle, self._epoch)
        return self

    def send(self, data: bytes) -> None:
        """Send any bytes now."""
        self.chip.uart_send(self.port, data, baud=self.baud)

    def _epoch(self) -> None:
        self.chip.at(self.chip.cycle + cycles(self.period_ms * 1e-3), self._epoch)
        self.itow_ms += self.period_ms
        if self.itow_ms >= 604_800_000:
            self.itow_ms -= 604_800_000
            self.week += 1
        if self.silent:
            return
        messages = b"".join(self._message(kind) for kind in sorted(self.enabled))
        if self.nmea:
            messages += b"$GPGGA,000000.00,,,,,0,00,99.99,,,,,,*66\r\n"
        if self.garbage:
            messages = bytes((37 * i + self.itow_ms) & 0xFF for i in range(120))
        if messages:
            self.epochs.append((self.chip.cycle, self.itow_ms))
            self.send(messages)

    def _message(self, kind: tuple[int, int]) -> bytes:
        north, east, down = self.velocity_cmps
        ground = round((north**2 + east**2) ** 0.5)
        if kind == POSLLH:
            body = struct.pack(
                "<IiiiiII", self.itow_ms, self.longitude_1e7, self.latitude_1e7,
                self.height_mm + 20_000, self.height_mm, 2500, 3500,
            )  # fmt: skip
        elif kind == SOL:
            body = struct.pack(
                "<IihBBiiiIiiiIHBBI", self.itow_ms, 0, self.week, self.fix, 0x0D if self.fix else 0,
                0, 0, 0, 300, 0, 0, 0, 50, 180, 0, self.satellites, 0,
            )  # fmt: skip
        elif kind == VELNED:
            body = struct.pack(
                "<IiiiIIiII", self.itow_ms, north, east, down, ground, ground, 0, 50, 100_000
            )
        elif kind == PVT:
            body = struct.pack(
                "<IHBBBBBBIiBBBBiiiiIIiiiiiIIH6xihH", self.itow_ms, *self._utc(), 0x07,
                50, 0, self.fix, 1 if self.fix else 0, 0, self.satellites, self.longitude_1e7,
                self.latitude_1e7, self.height_mm + 20_000, self.height_mm, 2500, 3500,
                10 * north, 10 * east, 10 * down, 10 * ground, 0, 500, 100_000, 180, 0, 0, 0,
            )  # fmt: skip
        else:
            return b""
        return ubx(kind, body)

    def _utc(self) -> tuple[int, ...]:
        """Year to second of the epoch."""
        seconds = self.itow_ms // 1000 - LEAP_S
        at = GPS_BEGAN + timedelta(weeks=self.week, seconds=seconds)
        return at.timetuple()[:6]

    def _hears_baud(self) -> float:
        base = _UCSRA[self.port]
        control = self.chip.data(base, 6)
        divider = (control[4] | control[5] << 8) + 1
        return 16e6 / (divider * (8 if control[0] & 2 else 16))

    def _byte(self, byte: int, cycle: int) -> None:
        if self.deaf:
            return
        wrong = abs(self._hears_baud() / self.baud - 1.0) > 0.04
        self._heard.append(byte ^ 0xA5 if wrong else byte)
        while len(self._heard) >= 2 and self._heard[:2] != b"\xb5\x62":
            del self._heard[0]
        if len(self._heard) < 6:
            return
        size = self._heard[4] | self._heard[5] << 8
        if size > 256:
            del self._heard[0]
            return
        if len(self._heard) < size + 8:
            return
        message = bytes(self._heard[: size + 8])
        kind = (message[2], message[3])
        if ubx(kind, message[6:-2]) == message:
            del self._heard[: size + 8]
            self._command(kind, message[6:-2])
        else:
            del self._heard[0]

    def _command(self, kind: tuple[int, int], payload: bytes) -> None:
        self.configured.append(kind)
        accepted = True
        if kind == (6, 0x00) and len(payload) == 20:
            # acknowledged at the old rate; the new one holds from the next byte
            self.baud = int.from_bytes(payload[8:12], "little")
            self.nmea = bool(payload[14] & 2)
        elif kind == (6, 0x08):
            self.period_ms = int.from_bytes(payload[:2], "little")
        elif kind == (6, 0x01) and len(payload) == 3:
            wanted = (payload[0], payload[1])
            accepted = wanted in (POSLLH, SOL, VELNED) or (wanted == PVT and self.knows_pvt)
            if accepted and payload[2]:
                self.enabled.add(wanted)
            else:
                self.enabled.discard(wanted)
        self.send(ubx((5, 1 if accepted else 0), bytes(kind)))
