"""`host status`: what the logger says of itself, live over USB."""

from __future__ import annotations

import argparse
import json
import math
import sys
from typing import TYPE_CHECKING, Any

from host.terminal import bare

if TYPE_CHECKING:
    from collections.abc import Iterator

    from host.link.serial import Received
    from host.link.status_line import StatusLine

_SHOWN_BYTES = 32


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "status",
        help="show what the logger says of itself, live over USB",
        description="Show the line that the logger writes once a second while it records nothing:"
        " image, each sensor, receiver channels, who drives the servos, card, supply.",
        epilog="Opening a Mega's port resets it, as its DTR line is wired to reset. Linux and macOS"
        " raise DTR at the first opening after plugging in; later ones leave it up. On Windows it"
        " stays down. Not before a flight that counts, then: a reset ends the session. Ctrl-C"
        " ends. Exit code 5: no port, a busy or silent one, or another device.",
    )
    parser.add_argument(
        "port", nargs="?", help="COM5, /dev/ttyACM0, ...; without it the one that looks like a Mega"
    )
    parser.add_argument("--once", action="store_true", help="show one line and stop")
    parser.add_argument("--json", action="store_true", help="print one JSON object per line")
    parser.add_argument(
        "--timeout",
        type=_seconds,
        default=8.0,
        metavar="S",
        help="how long to wait for the first line (default 8: bootloader, start, one second)",
    )


def run(args: argparse.Namespace) -> int:
    """Show status lines until Ctrl-C, or one of them."""
    from host.errors import ExitCode
    from host.link.serial import SerialLink, choose_port, receive, serial_ports

    device = args.port
    if device is None:
        device = choose_port(serial_ports()).device
        print(f"host: {device}", file=sys.stderr)
    screen = _Screen(as_json=args.json)
    with SerialLink(device) as link:
        try:
            for line in _status_lines(receive(link), device, args.timeout, screen):
                screen.show(line)
                if args.once:
                    break
        except KeyboardInterrupt:
            if not screen.shown:
                raise
    return int(ExitCode.OK)


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < 3600:
        raise argparse.ArgumentTypeError(f"{text} is not a time between 0 and 3600 seconds")
    return value


class _Screen:
    """Rows on a terminal, drawn over the last ones; one below the other elsewhere."""

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json
        self._redraw = sys.stdout.isatty() and not as_json
        self._rows = 0
        self._silent = False
        self.shown = False

    def show(self, line: StatusLine) -> None:
        self.shown = True
        rows = [json.dumps(line.as_json())] if self._as_json else line.lines()
        if self._redraw and self._rows:
            bare(sys.stdout).write(f"\033[{self._rows}A\033[J")
        sys.stdout.write("\n".join(rows) + "\n")
        sys.stdout.flush()
        self._rows = len(rows)
        self._silent = False

    def silent(self, seconds: float) -> None:
        """Say once that what is shown is old."""
        if not self._silent:
            print(
                f"host: no line for {seconds:.0f} s, the values above are old:"
                " it records, or it is off",
                file=sys.stderr,
            )
            self._silent = True
            self._rows = 0


def _status_lines(
    received: Iterator[Received], device: str, timeout_s: float, screen: _Screen
) -> Iterator[StatusLine]:
    """Yield status lines; give up if none comes at first, say so if they stop later."""
    from host.link.serial import DeviceError, printable
    from host.link.status_line import parse_status

    count_bytes = 0
    sample = b""
    last_s: float | None = None
    old_s = 3.0  # two lines missing
    for portion in received:
        last_s = portion.now_s if last_s is None else last_s
        count_bytes += len(portion.data)
        sample = sample or portion.data[:_SHOWN_BYTES]
        for text in portion.lines:
            line = parse_status(text)
            if line is not None:
                last_s = portion.now_s
                yield line
        waited_s = portion.now_s - last_s
        if screen.shown:
            if waited_s > old_s:
                screen.silent(waited_s)
        elif waited_s > timeout_s and count_bytes == 0:
            raise DeviceError(
                f"{device}: silent for {timeout_s:g} s; the logger says nothing while it records,"
                " else: is it powered, and is its image uploaded?"
            )
        elif waited_s > timeout_s:
            raise DeviceError(
                f"{device}: {count_bytes} bytes in {timeout_s:g} s but no status line"
                f" (they begin {printable(sample)!r}); expected the logger at 115200 baud"
            )
