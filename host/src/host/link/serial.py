"""The USB line of the logger: which port, and its bytes as lines."""

from __future__ import annotations

import errno
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from host.errors import ExitCode, HostError, UsageError
from host.wire.framing import EnvelopeReader

BAUD = 115200
LONGEST_LINE = 1024  # bytes; a status line has at most 210
_READ_S = 0.05

# Arduino's boards.txt, section "mega"; 2A03 is the vendor id of arduino.org.
_MEGAS = {(vendor, product) for vendor in (0x2341, 0x2A03) for product in (0x0010, 0x0042)} | {
    (0x2341, 0x0210),
    (0x2341, 0x0242),
}
# USB-serial chips found on clones, and on much else.
_CHIPS = {
    (0x1A86, 0x7523): "CH340",
    (0x1A86, 0x5523): "CH341",
    (0x1A86, 0x55D4): "CH9102",
    (0x10C4, 0xEA60): "CP2102",
    (0x0403, 0x6001): "FT232",
}


class DeviceError(HostError):
    """A device that is missing, busy, silent, or no logger."""

    exit_code = ExitCode.DEVICE


@dataclass(frozen=True, slots=True)
class SerialPort:
    """One serial port of this computer.

    Parameters
    ----------
    device : str
        What `host status` takes: ``COM5``, ``/dev/ttyACM0``.
    description : str
        Description by the operating system.
    vendor_id, product_id : int or None
        USB ids; None for a port that is not on USB.
    serial_number : str
        Serial number of the USB device; empty where it has none, as clones.
    """

    device: str
    description: str
    vendor_id: int | None = None
    product_id: int | None = None
    serial_number: str = ""

    @property
    def usb_ids(self) -> str:
        """``2341:0042``, or empty."""
        if self.vendor_id is None or self.product_id is None:
            return ""
        return f"{self.vendor_id:04x}:{self.product_id:04x}"

    @property
    def is_mega(self) -> bool:
        """True for the USB ids of an Arduino Mega 2560."""
        return (self.vendor_id, self.product_id) in _MEGAS

    @property
    def chip(self) -> str:
        """Name of the USB-serial chip that a clone of the Mega may carry, or empty."""
        if self.vendor_id is None or self.product_id is None:
            return ""
        return _CHIPS.get((self.vendor_id, self.product_id), "")

    @property
    def looks_like(self) -> str:
        """What the USB ids say, in words."""
        if self.is_mega:
            return "Arduino Mega 2560"
        if self.chip:
            return f"perhaps a Mega clone ({self.chip})"
        return "other USB device" if self.usb_ids else "not on USB"


def serial_ports() -> list[SerialPort]:
    """List the serial ports of this computer, those that look like a Mega first."""
    from serial.tools import list_ports

    found = [
        SerialPort(
            device=str(port.device),
            description=str(port.description or ""),
            vendor_id=port.vid,
            product_id=port.pid,
            serial_number=str(port.serial_number or ""),
        )
        for port in list_ports.comports()
    ]
    return sorted(found, key=lambda p: (not p.is_mega, not p.chip, not p.usb_ids, p.device))


def choose_port(ports: list[SerialPort]) -> SerialPort:
    """Take the one port that looks like a Mega.

    Raises
    ------
    DeviceError
        If there is no port, or none that could be a Mega.
    UsageError
        If more than one could.
    """
    if not ports:
        raise DeviceError(
            "no serial port found; plug the logger in (a USB cable that carries data)"
            " or name its port"
        )
    likely = [p for p in ports if p.is_mega] or [p for p in ports if p.chip]
    if not likely:
        names = ", ".join(p.device for p in ports[:4]) + (", ..." if len(ports) > 4 else "")
        raise DeviceError(
            f"no port looks like a Mega (found {names}); plug the logger in"
            " or name its port: host status PORT"
        )
    if len(likely) > 1:
        names = ", ".join(p.device for p in likely)
        raise UsageError(f"{names} each look like a Mega; name one: host status PORT")
    return likely[0]


class LineSplitter:
    """Joins bytes that come in portions to whole lines.

    A line longer than `LONGEST_LINE` bytes is thrown away with its end: noise has no line ends.
    """

    def __init__(self) -> None:
        self._rest = bytearray()
        self._overlong = False

    def feed(self, data: bytes) -> list[str]:
        r"""Return the lines that `data` completes, without ``\r\n``.

        Bytes that are not printable ASCII become U+FFFD, so that no terminal obeys them.
        """
        lines: list[str] = []
        self._rest += data
        while (end := self._rest.find(b"\n")) >= 0:
            line = bytes(self._rest[:end]).removesuffix(b"\r")
            del self._rest[: end + 1]
            if not self._overlong and len(line) <= LONGEST_LINE:
                lines.append(printable(line))
            self._overlong = False
        if len(self._rest) > LONGEST_LINE:
            self._rest.clear()
            self._overlong = True
        return lines


def printable(data: bytes) -> str:
    """Return ASCII text; every other byte as U+FFFD."""
    return "".join(chr(byte) if 32 <= byte < 127 else "\ufffd" for byte in data)


class SerialLink:
    """An open serial port, closed by ``with``.

    Opening it resets a Mega: its DTR line is wired to reset. Windows lets us open without raising
    DTR. Linux and macOS raise it themselves; there the port is set to leave DTR up when it is
    closed, so that only the first opening after plugging in resets the board.

    Parameters
    ----------
    device : str
        ``COM5``, ``/dev/ttyACM0``.
    baud : int
        That of the logger's USB line unless given.

    Raises
    ------
    DeviceError
        If the port is missing, busy, not allowed, or not a serial port; also from `data` when it
        goes away.
    """

    def __init__(self, device: str, baud: int = BAUD) -> None:
        import serial

        self.device = device
        self._error: type[Exception] = serial.SerialException
        self._port: Any = serial.Serial()
        self._port.port = device
        self._port.baudrate = baud
        self._port.timeout = _READ_S
        self._port.exclusive = None if sys.platform == "win32" else True
        self._port.dtr = self._port.rts = sys.platform != "win32"
        try:
            self._port.open()
        except (serial.SerialException, OSError, ValueError) as error:
            raise DeviceError(f"{device}: {_why_not(device, error)}") from error
        _keep_dtr(self._port)

    def __enter__(self) -> SerialLink:
        return self

    def __exit__(self, *_: object) -> None:
        self._port.close()

    def data(self) -> bytes:
        """Return the bytes received, after at most 50 ms; empty without any."""
        try:
            return bytes(self._port.read(max(1, int(self._port.in_waiting))))
        except (self._error, OSError) as error:
            raise DeviceError(f"{self.device}: went away; is the cable still in?") from error

    def send(self, data: bytes) -> None:
        """Send bytes; they have left when this returns."""
        try:
            self._port.write(data)
            self._port.flush()
        except (self._error, OSError) as error:
            raise DeviceError(f"{self.device}: went away; is the cable still in?") from error


def _keep_dtr(port: Any) -> None:
    if sys.platform == "win32":
        return
    import termios

    attributes = termios.tcgetattr(port.fileno())
    attributes[2] &= ~termios.HUPCL  # c_cflag: hang up (drop DTR) on last close
    termios.tcsetattr(port.fileno(), termios.TCSANOW, attributes)


def _why_not(device: str, error: Exception) -> str:
    """Say in words why a port could not be opened."""
    number = getattr(error, "errno", None)
    text = str(error).lower()
    look = "`host ports` lists those there are"
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV) or "filenotfound" in text:
        return f"no such port; {look}"
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text:
        return "busy: another program has it open (a monitor, an upload); close that one"
    if "permissionerror" in text or "access is denied" in text:  # Windows, of a port in use
        return "busy: another program has it open (a monitor, an upload); close that one"
    if number in (errno.EACCES, errno.EPERM):
        return "not allowed; join the group that owns it (often dialout) and log in again"
    no_tty = number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR) or Path(device).is_file()
    if no_tty or "could not configure port" in text:  # pyserial's word for ENOTTY
        return f"not a serial port; {look}"
    return f"cannot be opened ({error}); {look}"


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes and lines received during one short wait.

    Parameters
    ----------
    data : bytes
        As received.
    lines : list of str
        Whole lines, see `LineSplitter`.
    now_s : float
        Seconds on the clock of the reader.
    """

    data: bytes
    lines: list[str]
    now_s: float


class _Bytes(Protocol):
    def data(self) -> bytes: ...


def receive(link: _Bytes, clock: Callable[[], float] = time.monotonic) -> Iterator[Received]:
    """Yield for ever what comes in, at least every 50 ms; the first line may be cut and is left.

    Between two lines the logger sends its channels in envelopes; these are passed over.
    """
    splitter, envelopes = LineSplitter(), EnvelopeReader()
    begun = False
    while True:
        data = link.data()
        envelopes.feed(data)
        text = envelopes.between
        lines = splitter.feed(text)
        yield Received(data, lines if begun else lines[1:], clock())
        begun = begun or b"\n" in text
