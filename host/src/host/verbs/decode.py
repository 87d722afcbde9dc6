"""`host decode`: a log becomes a table in SI, and a summary of how good it is."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from host.decode.newest_flight import source_or_newest
from host.source_arguments import add_log_arguments, add_output

_DESCRIPTION = """\
Decode a flight log: print what it holds and how good it is, write the synchronous
table in SI at the identification rate. SOURCE is a log, a folder or a mounted card
(the newest flight is taken), a log of PX4 or ArduPilot (.ulg, .bin, .log, .tlog), or a
text file of the original ASCII rows.
"""
_EPILOG = """\
exit codes: 0 ok, 2 usage, 3 decoded with losses (all named), 4 not a log,
6 --strict and anything is lost, stuck, saturated, missing, or a pair of sensors disagrees
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "decode",
        help="turn a log into a table in SI and say how good it is",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_log_arguments(parser)
    add_output(parser, "file or folder to write; - for stdout (csv); the working folder without it",
               "PATH", str)  # fmt: skip
    parser.add_argument(
        "--to",
        choices=("csv", "parquet", "mat", "npz"),
        help="format; that of --output's ending, else csv",
    )
    parser.add_argument(
        "--frames", action="store_true", help="write the raw frames too, one file per kind"
    )
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")
    parser.add_argument(
        "--strict", action="store_true", help="end with code 6 unless the log is without fault"
    )


def run(args: argparse.Namespace) -> int:
    """Decode, print, write; return the exit code."""
    from host.decode.decoding import decode
    from host.decode.writing import Request
    from host.readers.autopilot_flight import log_choices
    from host.text import shown

    request = Request(
        source=source_or_newest(args.source),
        output=args.output,
        format=args.to,
        frames=args.frames,
        session=args.session,
        file_id=args.file_id,
        calibration=args.calibration,
        row_rate_hz=args.row_rate,
        sensors=tuple(log_choices(args.sensor, args.outputs).items()),
    )
    result = decode(request)
    out = sys.stderr if args.output == "-" else sys.stdout
    if args.json:
        print(json.dumps(result.summary, indent=2, allow_nan=False), file=out)
    else:
        print("\n".join(map(shown, result.lines)), file=out)
    return int(result.exit_code(strict=args.strict))
