"""`host export`: a flight for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from host.source_arguments import add_log_arguments, add_output
from host.verbs.plot import flight_request

_KINDS = ("tlog", "ulog", "kml", "kmz", "gpx", "mcap")
_DESCRIPTION = """\
Write a flight for other programs: tlog (Mission Planner, QGroundControl, MAVExplorer),
ulog and mcap (PlotJuggler, Foxglove; a layout for PlotJuggler comes along), kml and kmz
(Google Earth), gpx (maps). Tables are written by `host decode --to csv|parquet|mat|npz`.
"""
_EPILOG = """\
exit codes: 0 ok, 2 usage, 3 written with losses (as gaps), 4 not a log
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "export",
        help="write a flight for other programs",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_log_arguments(parser)
    parser.add_argument("--to", choices=_KINDS, action="append", required=True,
                        help="format; repeatable")  # fmt: skip
    add_output(parser, "file or folder to write; the working folder without it", "PATH", Path)
    parser.add_argument(
        "--rate", type=float, metavar="HZ", help="rows a second of tlog (default 25)"
    )


def run(args: argparse.Namespace) -> int:
    """Write the files, say which; return the exit code."""
    from host.report.exporting import ExportRequest, export
    from host.text import shown

    request = ExportRequest(
        flight_request(args), tuple(dict.fromkeys(args.to)), args.output, args.rate
    )
    _, said, code = export(request)
    print("\n".join(map(shown, said)))
    return int(code)
