"""`host preflight`: the walk round the aircraft, each item green by itself when it is seen."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from host.terminal import bare

_DESCRIPTION = """\
A guided list before the flight: each item turns green by itself when its motion is seen, on the
terminal and on the page; wrong direction, dead, swapped or stale sensors are named. Listens only.
SOURCE is what `host live` takes (radio's port, udp:PORT, a recording), the Mega's USB port, or

  sim:walk[@4x]         a virtual walk round a healthy aircraft, to practise
  sim:walk/FAULT        the same with a fault, such as surface_reversed
"""
_EPILOG = """\
While it runs: Enter goes on where nothing is seen (the item stays red), the name of an item looks
at it again, q ends. The sheet lies by the capture, as TOML. More: host/PREFLIGHT.md
exit codes: 0 GO, 2 usage, 5 no radio, or its port is busy or gone, 6 NO-GO
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "preflight",
        help="walk round the aircraft: each check turns green by itself",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("source", nargs="?", metavar="SOURCE", help="see above")
    parser.add_argument("--aircraft", metavar="NAME", help="name or file of the aircraft")
    parser.add_argument("--calibration", type=Path, metavar="FILE", help="counts to SI")
    parser.add_argument("--by", default="", metavar="WHO", help="name on the sheet")
    parser.add_argument("--without", action="append", default=[], metavar="ITEM[=WHY]",
                        help="leave an item out (not fitted); it stands on the sheet; vanes,"
                        " pitots, pots: all of them")  # fmt: skip
    parser.add_argument(
        "--flight-card",
        type=Path,
        metavar="FILE",
        help="the logger's card: asks for the proof of its hold, if it holds; sim:walk gives it",
    )
    parser.add_argument("--list", action="store_true", help="print the checks, and stop")
    parser.add_argument("--sheet", type=Path, metavar="TOML",
                        help="sheet to write (default: next to the capture)")  # fmt: skip
    parser.add_argument("-o", "--output", type=Path, metavar="PATH",
                        help="capture's file or folder (default: the working folder)")  # fmt: skip
    parser.add_argument("--baud", type=int, metavar="N",
                        help="baud rate (default: radio 57600, a Mega's USB 115200)")  # fmt: skip
    parser.add_argument("--port", type=int, metavar="N", help="TCP port of the page")
    parser.add_argument("--lan", action="store_true", help="let others in this network look")
    parser.add_argument("--no-page", action="store_true",
                        help="terminal only; ends behind the last item")  # fmt: skip
    parser.add_argument("--mavlink", metavar="udpout:HOST:PORT",
                        help="send to a ground station; GO is its pre-arm check")  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of a virtual walk")
    parser.add_argument("--json", action="store_true",
                        help="print a JSON object for each change of an item")  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Walk round the aircraft; return whether it is GO."""
    from host.errors import ExitCode
    from host.live.live_request import LiveRequest
    from host.preflight.preflight_program import PreflightRequest, run_preflight, typed_line
    from host.preflight.preflight_screen import PreflightScreen

    aircraft = _aircraft(args)
    without = dict(_left_out(one) for one in args.without)
    if args.list:
        return _list(args, aircraft, without)
    live = LiveRequest(
        source=args.source, output=args.output, baud=args.baud, calibration=args.calibration,
        port=args.port, lan=args.lan, page=not args.no_page, mavlink=args.mavlink, seed=args.seed,
    )  # fmt: skip
    request = PreflightRequest(
        live, aircraft, args.by, without, args.sheet, args.json, args.flight_card
    )
    screen = PreflightScreen(as_json=args.json, show=lambda line: print(line, flush=True))
    summary = run_preflight(request, screen, typed_line if sys.stdin.isatty() else None)
    if sys.stderr.isatty():
        bare(sys.stderr).write("\r")
    for line in summary.lines(page=not args.no_page):
        print(f"host: {line}", file=sys.stderr)
    return int(ExitCode.OK if summary.go else ExitCode.CHECK)


def _aircraft(args: argparse.Namespace) -> str:
    """Return the aircraft's name or file; a virtual walk has a default."""
    from host.errors import UsageError
    from host.preflight.preflight_program import PRACTISED, SIMULATED

    if args.aircraft:
        return str(args.aircraft)
    if (args.source or "").startswith(SIMULATED) or args.list:
        return PRACTISED
    raise UsageError(
        "which aircraft? --aircraft mine.toml: its travels are looked at; or practise with"
        " host preflight sim:walk"
    )


def _left_out(text: str) -> tuple[str, str]:
    item, _, why = text.partition("=")
    return item, why or "not fitted"


def _list(args: argparse.Namespace, aircraft: str, without: dict[str, str]) -> int:
    """Print the list of checks."""
    import json

    from host.errors import ExitCode
    from host.physical.calibration import load_calibration
    from host.preflight.check_list import CheckListInputs, check_list, checked_aircraft, good_card

    plane, lines = checked_aircraft(aircraft), load_calibration(args.calibration)
    card = good_card(args.flight_card)
    wanted = CheckListInputs(plane, lines, without=without, flight_card=card)
    checks = check_list(wanted)
    if args.json:
        print(json.dumps([{"item": c.key, "title": c.title, "step": c.step} for c in checks]))
        return int(ExitCode.OK)
    for check in checks:
        print(f"{check.key:14s} {check.title}: {check.step}")
    return int(ExitCode.OK)
