"""`host convert`: dimensional derivatives to coefficients of an aircraft, and back."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "convert",
        help="turn derivatives into coefficients, and back",
        description="Turn dimensional derivatives (M_q in 1/s) into coefficients (Cm_q) or back,"
        " with what the aircraft file leaves open of mass, inertia, CG and calibration in the"
        " intervals.",
    )
    parser.add_argument(
        "source",
        type=Path,
        help="model of `host identify --save-model`; TOML with [derivatives] or [coefficients],"
        " each a number or [value, half-width]; output of AVL or Datcom",
    )
    parser.add_argument("--aircraft", metavar="NAME", required=True,
                        help="aircraft file: mass, sizes, tolerances")  # fmt: skip
    parser.add_argument(
        "--airspeed",
        type=float,
        metavar="M/S",
        help="true airspeed (default: the model's, else the aircraft's)",
    )
    parser.add_argument("--alpha", type=float, metavar="DEG",
                        help="angle of attack (default: the model's, else 0)")  # fmt: skip
    parser.add_argument("--density", type=float, metavar="KG/M3", default=1.225,
                        help="of the air (default: 1.225, standard at sea level)")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Convert and print."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from math import radians

    from host.aircraft.aircraft_ranges import AIRSPEED, ALPHA_DEG, DENSITY
    from host.aircraft.file import load_measured
    from host.aircraft.origin import announce_aircraft
    from host.errors import ExitCode, UsageError
    from host.sysid.answer import json_text
    from host.sysid.conversion import (
        FlightCondition,
        conversion_document,
        conversion_lines,
        convert,
    )

    for option, quantity in (("airspeed", AIRSPEED), ("density", DENSITY), ("alpha", ALPHA_DEG)):
        value = getattr(args, option)
        if value is not None:
            quantity.check(f"--{option}", value, UsageError)
    alpha_rad = None if args.alpha is None else radians(args.alpha)
    done = convert(
        args.source, args.aircraft, FlightCondition(args.airspeed, alpha_rad, args.density)
    )
    announce_aircraft([args.aircraft])
    for doubt in load_measured(args.aircraft).doubts:
        print(f"host: {doubt}", file=sys.stderr)
    if args.json:
        print(json_text(conversion_document(done)))
    else:
        print("\n".join(conversion_lines(done)))
    return int(ExitCode.OK)
