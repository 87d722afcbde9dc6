"""`host info`: what a log is, from its head."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "info",
        help="say what a log is, from its head",
        description="Say what a log is, at once: only the first 256 KiB are read.",
    )
    parser.add_argument(
        "source",
        type=Path,
        nargs="?",
        default=Path(),
        metavar="SOURCE",
        help="log, folder or mounted card; the working folder without it",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Print what the head of a log says."""
    from host.errors import ExitCode
    from host.log.head import describe, describe_folder, head_lines
    from host.log.source import check_source
    from host.text import shown

    source = check_source(args.source)
    if source.is_dir():
        flights = describe_folder(source)
        print(
            json.dumps(flights, indent=2) if args.json else "\n".join(map(shown, _table(flights)))
        )
        return int(ExitCode.OK)
    head = describe(source)
    print(json.dumps(head, indent=2) if args.json else "\n".join(map(shown, head_lines(head))))
    return int(ExitCode.OK)


def _table(flights: list[dict[str, Any]]) -> list[str]:
    lines = [f"{'session':>8}  {'bytes':>12}  file"]
    for flight in flights:
        note = "" if flight["recorded"] else "  (prepared, nothing recorded)"
        lines.append(f"{flight['session']:>8}  {flight['size_bytes']:>12}  {flight['file']}{note}")
    return lines
