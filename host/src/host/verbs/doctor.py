"""`host doctor`: libraries, ports, caches and settings."""

from __future__ import annotations

import argparse
import json
from typing import Any


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "doctor",
        help="say what is installed, plugged in, set and kept",
        description="Say versions, extras and how to get those that are missing, compilers, serial"
        " ports, caches, and every setting in force with where it comes from.",
        epilog="Exit code 6: a library without which nothing works is missing.",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Look around and print."""
    from host.errors import CheckError, ExitCode
    from host.installation.inventory import inventory, inventory_lines

    found = inventory()
    print(json.dumps(found.document()) if args.json else "\n".join(inventory_lines(found)))
    if found.missing:
        raise CheckError(f"missing: {', '.join(found.missing)}; install this package again")
    return int(ExitCode.OK)
