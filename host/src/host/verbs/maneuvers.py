"""`host maneuvers`: find the test points of a log and grade them."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from host.decode.newest_flight import source_or_newest
from host.placed_arguments import READS
from host.source_arguments import add_flight, add_output, add_row_rate, add_sensor


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "maneuvers",
        help="find the test points of a log",
        description="Find the maneuvers of a flight from its control inputs, name and grade them:"
        " amplitude, trim before, noise, pilot feedback.",
    )
    parser.set_defaults(**{READS: True})
    parser.add_argument("source", type=Path, nargs="?",
                        help="log (also of PX4, ArduPilot), original rows, CSV, Parquet or MAT"
                        " file; without it the newest flight of the working folder")  # fmt: skip
    parser.add_argument("--map", type=Path, metavar="TOML",
                        help="foreign names, units and signs: a file, or the name of a shipped map"
                        " ('list' shows them)")  # fmt: skip
    parser.add_argument("--calibration", type=Path, metavar="TOML", help="calibration of a log")
    add_row_rate(parser)
    add_sensor(parser)
    add_output(parser)
    add_flight(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Print the maneuvers of a flight."""
    # The matrices are small: threads of BLAS only wait for each other (28 s against 5 measured).
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from host.errors import ExitCode, IdentificationError
    from host.readers.autopilot_flight import log_choices
    from host.readers.flight_choice import with_flight
    from host.readers.shipped_maps import LIST, map_lines
    from host.sysid.answer import json_text
    from host.sysid.answer.json_document import maneuver_document
    from host.sysid.answer.maneuver_list import maneuver_lines
    from host.sysid.flight import read_columns
    from host.sysid.maneuvers import detect_maneuvers, grade
    from host.sysid.pipeline.arguments import option_words

    if str(args.map) == LIST:
        print("\n".join(map_lines()))
        return int(ExitCode.OK)
    try:
        source = with_flight(source_or_newest(args.source), args.flight)
        columns, notes = read_columns(source, args.map, calibration=args.calibration,
                                      sensors=log_choices(args.sensor, args.outputs),
                                      row_rate_hz=args.row_rate)  # fmt: skip
    except IdentificationError as error:
        raise IdentificationError(option_words(str(error))) from error
    graded = [(item, grade(columns, item)) for item in detect_maneuvers(columns)]
    if args.json:
        print(json_text({"notes": notes, "maneuvers": maneuver_document(graded)}))
    else:
        print("\n".join([*(f"note: {n}" for n in notes), *maneuver_lines(graded)]))
    return int(ExitCode.OK)
