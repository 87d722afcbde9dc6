"""`host info`: what a log is, from its head."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from host.decode.newest_flight import source_or_newest
from host.source_arguments import add_sensor


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "info",
        help="say what a log is, from its head",
        description="Say what a log is, at once: only the first 256 KiB are read. Of a log of PX4"
        " or ArduPilot all is read: what can be identified, and which setting to change.",
    )
    parser.add_argument(
        "source",
        type=Path,
        nargs="?",
        metavar="SOURCE",
        help="log, folder or mounted card (their flights are listed); the newest flight of the"
        " working folder without it",
    )
    add_sensor(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Print what the head of a log says."""
    from host.errors import ExitCode
    from host.log.head import describe, describe_folder, head_lines
    from host.log.source import check_source
    from host.readers.autopilot_flight import chosen_sensors, is_autopilot_log, read_autopilot
    from host.readers.autopilot_summary import summarise_autopilot, summary_lines
    from host.text import shown

    source = check_source(source_or_newest(args.source))
    if source.is_dir():
        flights = describe_folder(source)
        print(
            json.dumps(flights, indent=2) if args.json else "\n".join(map(shown, _table(flights)))
        )
        return int(ExitCode.OK)
    if is_autopilot_log(source):
        summary = summarise_autopilot(read_autopilot(source, chosen_sensors(args.sensor)))
        print(
            json.dumps(summary, indent=2)
            if args.json
            else "\n".join(map(shown, summary_lines(summary)))
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
