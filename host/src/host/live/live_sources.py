"""Where bytes come from: a port, a UDP port, a file played again, the recorder on this computer.

Each source is listened to, never spoken to. It yields portions of bytes, at least ten times a
second, empty ones in silence; what happens to its line it tells in words.
"""

from __future__ import annotations

import contextlib
import re
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

from host.errors import UsageError
from host.link.serial import BAUD, DeviceError, SerialLink, SerialPort, serial_ports

RADIO_BAUD = 57600  # firmware/settings.toml: telemetry_baud
_WAIT_S = 0.05  # between two portions, at most
_AGAIN_S = 0.5
_RADIO_CHIPS = ("FT232", "CP2102")  # of XBee adapters; CH340 is that of Mega clones
_DATAGRAM = 65536

SPEED = re.compile(r"(.+)@(max|[0-9]+(?:\.[0-9]+)?)x?", re.IGNORECASE)

Tell = Callable[[str], None]


class Source(Protocol):
    """What can be listened to."""

    @property
    def name(self) -> str:
        """As on the command line."""
        ...

    @property
    def baud(self) -> int:
        """Baud rate of a serial line; 0 for none."""
        ...

    @property
    def recorded(self) -> bool:
        """True where the bytes are on disk already."""
        ...

    def portions(self, tell: Tell) -> Iterator[bytes]:
        """Yield bytes as they come, for ever or to the end of a recording."""
        ...


@dataclass(slots=True)
class PortSource:
    """A serial port, opened again when it comes back.

    Parameters
    ----------
    name : str
        ``COM5``, ``/dev/ttyUSB0``, ``/dev/cu.usbserial-A1``.
    baud : int
    """

    name: str
    baud: int = RADIO_BAUD
    recorded: bool = False
    _link: SerialLink | None = None

    def open(self) -> Self:
        """Open the port, before anything is made for it; raises DeviceError."""
        self._link = SerialLink(self.name, self.baud)
        return self

    def portions(self, tell: Tell) -> Iterator[bytes]:
        """Yield bytes, for ever."""
        link = self._link or SerialLink(self.name, self.baud)
        while True:
            with link:
                try:
                    while True:
                        yield link.data()
                except DeviceError:
                    tell(f"{self.name} went away; waiting for it, what came is on disk")
            while True:
                yield b""
                yield from silence(time.monotonic() + _AGAIN_S)
                with contextlib.suppress(DeviceError):
                    link = SerialLink(self.name, self.baud)
                    break
            tell(f"{self.name} is back")


@dataclass(slots=True)
class UdpSource:
    """Datagrams of the same stream, as radio bridges send them.

    Parameters
    ----------
    host : str
        Address to listen at; 127.0.0.1 unless given.
    port : int
    """

    host: str
    port: int
    baud: int = 0
    recorded: bool = False
    _listener: socket.socket | None = None

    @property
    def name(self) -> str:
        """As on the command line."""
        return f"udp:{self.host}:{self.port}"

    def open(self) -> Self:
        """Take the port; raises DeviceError if it is taken or not ours."""
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            listener.bind((self.host, self.port))
        except OSError as error:
            listener.close()
            raise DeviceError(
                f"{self.name}: cannot listen there ({error.strerror}); another program has the"
                " port, or the address is not this computer's"
            ) from None
        listener.settimeout(_WAIT_S)
        self._listener = listener
        return self

    def portions(self, tell: Tell) -> Iterator[bytes]:
        """Yield each datagram's bytes, for ever."""
        del tell
        listener = self._listener or self.open()._listener
        assert listener is not None
        with listener:
            while True:
                try:
                    yield listener.recv(_DATAGRAM)
                except TimeoutError:
                    yield b""


def silence(until_s: float) -> Iterator[bytes]:
    """Wait for a time on the clock of `time.monotonic`, and yield nothing often enough."""
    while (wait_s := until_s - time.monotonic()) > 0.0:
        time.sleep(min(_WAIT_S, wait_s))
        yield b""


def choose_radio(ports: list[SerialPort]) -> SerialPort:
    """Take the one port that looks like a radio's; a Mega is never opened to search.

    Raises
    ------
    DeviceError
        If there is none.
    UsageError
        If more than one could be.
    """
    radios = [port for port in ports if port.chip in _RADIO_CHIPS]
    others = [p for p in ports if p.usb_ids and not p.is_mega and not p.chip]
    likely = radios or others
    if len(likely) > 1:
        names = ", ".join(port.device for port in likely)
        raise UsageError(f"{names} may each be the radio; name one: host live PORT")
    if likely:
        return likely[0]
    megas = [port.device for port in ports if port.is_mega or port.chip]
    if megas:
        raise DeviceError(
            f"only {', '.join(megas)}, which looks like a Mega: opening it resets the Mega, so it"
            " is not tried; plug the radio in, or name the port if the aircraft is on the ground"
        )
    raise DeviceError(
        "no radio found; plug it in, name its port (`host ports` lists them), or try"
        " host live sim:demo"
    )


def port_source(name: str | None, baud: int | None, tell: Tell) -> PortSource:
    """Return the port that was named, or the one that looks like a radio's.

    Without a baud rate it is the radio's; that of USB where the port can only be the logger's own.
    """
    ports = serial_ports()
    if name is None:
        chosen = choose_radio(ports)
        tell(f"listening to {chosen.device} ({chosen.looks_like}, {chosen.description})")
        return PortSource(chosen.device, baud or RADIO_BAUD).open()
    named = next((p for p in ports if p.device == name and (p.is_mega or p.chip)), None)
    usual = RADIO_BAUD if named is None or named.chip in _RADIO_CHIPS else BAUD
    if named is not None:
        tell(
            f"{name} may be a Mega: opening its port resets it, never do so in flight; listening"
            f" at {baud or usual} baud, to what it sends while it records nothing"
        )
    return PortSource(name, baud or usual).open()


def udp_source(text: str) -> UdpSource:
    """Return the source of ``udp:PORT`` or ``udp:HOST:PORT``; raises UsageError."""
    host, _, port = text.removeprefix("udp:").rpartition(":")
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise UsageError(f"{text}: expected udp:PORT or udp:HOST:PORT, with a port up to 65535")
    return UdpSource(host or "127.0.0.1", int(port)).open()


def is_file_like(text: str) -> bool:
    """Tell whether a SOURCE without a prefix is meant as a file and not as a port."""
    path = Path(SPEED.sub(r"\1", text))
    return Path(text).is_file() or path.is_file() or path.suffix.lower() in (".radio", ".bin")
