"""`host live`: the flight as it is received, on disk first, on a page then."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

from host.terminal import bare

_DESCRIPTION = """\
Receive the logger's radio: every byte goes to disk first, then to a page in the
browser. Listens only: nothing is ever sent to the aircraft. SOURCE is

  nothing               the one port that looks like a radio's (a Mega is not tried)
  COM5, /dev/ttyUSB0    a port; a Mega's own too, which sends its channels while it records
                        nothing: opening it resets it, never in flight
  udp:14600             datagrams at this UDP port (udp:HOST:PORT: at another address)
  replay:FILE[@10x]     a log of the card or a ground capture, as the radio had sent it
  FILE                  the same; @max as fast as it can be decoded
  sim:CARD              a virtual flight (host simulate), flown now
"""
_EPILOG = """\
Captures are read by `host decode`, `maneuvers` and `identify` like any log. Viewers of
--lan only look. Ctrl-C ends. More: host/LIVE.md, a day at the field: host/FIELD.md.
exit codes: 0 ok, 2 usage, 4 not a log, 5 no radio, or its port is busy or gone
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "live",
        help="receive the radio in flight: on disk, and on a page",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("source", nargs="?", metavar="SOURCE", help="see above")
    parser.add_argument("-o", "--output", type=Path, metavar="PATH",
                        help="capture's file or folder (default: the working folder; of a"
                        " replay no capture)")  # fmt: skip
    parser.add_argument("--calibration", type=Path, metavar="FILE",
                        help="counts to SI; a copy goes into the capture's head")  # fmt: skip
    parser.add_argument("--aircraft", metavar="NAME",
                        help="name or file of the aircraft: its derivatives are estimated while it"
                        " flies")  # fmt: skip
    parser.add_argument("--wanted", metavar="PERCENT",
                        help="half-widths to reach, per cent of each value: 8, or"
                        " Cm_q=15,Cn_r=25 (default 10)")  # fmt: skip
    parser.add_argument("--baud", type=_whole, metavar="N",
                        help="baud rate (default: radio 57600, a Mega's USB 115200)")  # fmt: skip
    parser.add_argument("--rate", type=_rate, metavar="HZ",
                        help="rows a second of a replay: of a log at most (default 20: a radio's),"
                        " of the original logger's rows as they were printed (default: GPS tells"
                        " it)")  # fmt: skip
    parser.add_argument("--port", type=_whole, metavar="N",
                        help="TCP port of the page (default: first free from 8050)")  # fmt: skip
    parser.add_argument("--lan", action="store_true",
                        help="let others in this network look, by the address it"
                        " prints")  # fmt: skip
    parser.add_argument("--no-page", action="store_true",
                        help="capture only; ends with a replay's end")  # fmt: skip
    parser.add_argument("--mavlink", metavar="udpout:HOST:PORT",
                        help="send to a ground station: QGroundControl, Mission Planner,"
                        " MAVProxy")  # fmt: skip
    parser.add_argument("--plotjuggler", metavar="udpout:HOST:PORT", nargs="?",
                        const="udpout:127.0.0.1:9870",
                        help="send rows as JSON datagrams to PlotJuggler's UDP server (default:"
                        " on this computer)")  # fmt: skip
    parser.add_argument("--preflight", type=Path, metavar="SHEET",
                        help="sheet of `host preflight`: shows its GO or NO-GO")  # fmt: skip
    parser.add_argument("--card", metavar="CARD",
                        help="card that is flown (host plan): each test point gets a verdict, the"
                        " next one a countdown")  # fmt: skip
    parser.add_argument("--distance", type=_distance, metavar="M",
                        help="largest distance from home, drawn and warned of (default: of the"
                        " flight card, 300)")  # fmt: skip
    parser.add_argument("--tiles", type=Path, metavar="PATH",
                        help="a map below the track: folder of z/x/y.png or .jpg, or an MBTiles"
                        " file of such")  # fmt: skip
    parser.add_argument("--flight-card", type=Path, metavar="FILE",
                        help="with sim:CARD: file of host plan CARD --card FILE; the logger flies"
                        " its inputs and sends what it learns")  # fmt: skip
    parser.add_argument(
        "--json",
        action="store_true",
        help="print the state once a second, and every verdict and what the logger learns, as JSON",
    )


def run(args: argparse.Namespace) -> int:
    """Receive until Ctrl-C."""
    from host.errors import ExitCode
    from host.live.live_program import run_live
    from host.live.live_request import LiveRequest
    from host.live.output_lines import OutputLines

    request = LiveRequest(
        source=args.source,
        output=args.output,
        baud=args.baud,
        calibration=args.calibration,
        rate_hz=args.rate,
        port=args.port,
        lan=args.lan,
        page=not args.no_page,
        json=args.json,
        mavlink=args.mavlink,
        plotjuggler=args.plotjuggler,
        aircraft=args.aircraft,
        wanted=args.wanted,
        card=args.card,
        flight_card=args.flight_card,
        distance_m=args.distance,
        tiles=args.tiles,
    )
    if args.preflight is not None:
        from host.preflight.preflight_sheet import shown_sheet

        request.joins.append(shown_sheet(args.preflight))
    lines = OutputLines()
    try:
        summary = run_live(request, lambda text: lines.err(f"host: {text}"), lines.out)
        if sys.stderr.isatty():
            bare(sys.stderr).write("\r")
        for line in summary.lines():
            lines.err(f"host: {line}")
    finally:
        lines.close()
    return int(ExitCode.OK)


def _whole(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) < 10_000_000:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number above 0")
    return int(text)


def _distance(text: str) -> float:
    return _number(text, 20.0, 20_000.0, "a distance between 20 and 20000 m")


def _rate(text: str) -> float:
    return _number(text, 1.0, 1000.0, "a rate between 1 and 1000 Hz")


def _number(text: str, least: float, most: float, expected: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(f"{text} is not {expected}")
    return value
