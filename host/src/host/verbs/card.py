"""`host card`: the flight card of the logger, over USB only."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from host.link.card_console import CardConsole

DO = ("write", "read", "check", "erase")


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "card",
        help="write, read, check or erase the logger's flight card over USB",
        description="The flight card says which test inputs the logger may add to the sticks, and"
        " within which limits. `host plan --card flight.card` makes it. It is written over USB"
        " only, on the ground, read back and compared; a half-written card is none. It flies"
        " nothing before it is enabled by hand on the ground.",
        epilog="Without PORT the one port that looks like a Mega is used; no other is opened. Exit"
        " code 5: no logger, it refuses, or it has no card; 6: the file is no good card.",
    )
    parser.add_argument("do", choices=DO, help="check: the file alone, or against the logger")
    parser.add_argument(
        "file", nargs="?", type=Path,
        help="flight.card: to write, to check; where to put what is read",
    )  # fmt: skip
    parser.add_argument("--port", help="COM5, /dev/ttyACM0, ...; check: compares with its card")
    parser.add_argument("--json", action="store_true", help="print the card as JSON")


def run(args: argparse.Namespace) -> int:
    """Do it; return an exit code."""
    if args.do in ("write", "check") and args.file is None:
        raise UsageError(f"host card {args.do} needs the file, such as flight.card")
    if args.do == "erase" and args.file is not None:
        raise UsageError("host card erase takes no file")
    data = _good(args.file) if args.do in ("write", "check") else None
    if data is None and args.do in ("write", "check"):
        return int(ExitCode.CHECK)
    if args.do == "check" and args.port is None and data is not None:
        _tell(data, as_json=args.json)
        return int(ExitCode.OK)
    return _on_logger(args, data)


def _good(path: Path) -> bytes | None:
    """Return a good card; None behind what is wrong with it."""
    from host.wire.flight_card import card_faults, card_file

    data = card_file(path)
    wrong = card_faults(data)
    for text in wrong:
        print(f"host: {path}: {text}", file=sys.stderr)
    return None if wrong else data


def _on_logger(args: argparse.Namespace, data: bytes | None) -> int:
    from host.link.card_console import CardConsole
    from host.link.serial import SerialLink, choose_port, serial_ports

    device = args.port
    if device is None:
        device = choose_port(serial_ports()).device
        print(f"host: {device}", file=sys.stderr)
    with SerialLink(device) as link:
        return act(args, CardConsole(link), data)


def act(args: argparse.Namespace, console: CardConsole, data: bytes | None) -> int:
    """Write, read, compare or erase; return an exit code."""
    from host.progress import draw_share
    from host.terminal import bar
    from host.wire.flight_card import card_faults

    if args.do == "erase":
        console.must("erase")
        print("erased: the logger has no card")
        return int(ExitCode.OK)
    if args.do == "write" and data is not None:
        console.write(data, lambda share: draw_share("card", share))
        bar.clear()
        _tell(data, as_json=args.json)
        print("written and read back; it is not enabled: that is done by hand, on the ground")
        return int(ExitCode.OK)
    kept = console.read(lambda share: draw_share("card", share))
    bar.clear()
    if args.do == "check":
        same = kept == data
        print("the logger has this card" if same else "the logger has another card")
        return int(ExitCode.OK if same else ExitCode.CHECK)
    if wrong := card_faults(kept):
        raise UsageError(f"the logger's card is none: {wrong[0]}; write it again")
    if args.file is not None:
        from host.export.atomic_files import atomic_write

        with atomic_write(args.file) as part:
            part.write_bytes(kept)
    _tell(kept, as_json=args.json)
    return int(ExitCode.OK)


def _tell(data: bytes, *, as_json: bool) -> None:
    """Print a card."""
    from host.wire.card_text import card_document, card_lines
    from host.wire.flight_card import read_card

    card = read_card(data)
    print(json.dumps(card_document(card)) if as_json else "\n".join(card_lines(card)))
