"""`host info`: what a log is, from its head."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from host.decode.newest_flight import source_or_newest
from host.placed_arguments import READS
from host.source_arguments import add_flight, add_output, add_sensor


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "info",
        help="say what a log is, from its head",
        description="Say what a log is, at once: only the first 256 KiB are read. Of a log of PX4"
        " or ArduPilot all is read: what can be identified, and which setting to change.",
    )
    parser.set_defaults(**{READS: True})
    parser.add_argument(
        "source",
        type=Path,
        nargs="?",
        metavar="SOURCE",
        help="log, folder or mounted card (their flights are listed); the newest flight of the"
        " working folder without it",
    )
    add_sensor(parser)
    add_output(parser)
    add_flight(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Print what the head of a log says."""
    from host.errors import ExitCode
    from host.log.head import describe, describe_folder, head_lines
    from host.log.source import check_source
    from host.readers.autopilot_flight import is_autopilot_log, log_choices, read_autopilot
    from host.readers.autopilot_summary import summarise_autopilot, summary_lines
    from host.readers.readable_file import readable_file, refuse_table
    from host.text import shown

    source = check_source(source_or_newest(args.source))
    if source.is_dir():
        flights = describe_folder(source)
        print(
            json.dumps(flights, indent=2) if args.json else "\n".join(map(shown, _table(flights)))
        )
        return int(ExitCode.OK)
    source = readable_file(source)
    if is_autopilot_log(source):
        choices = log_choices(args.sensor, args.outputs)
        flight = read_autopilot(source, choices, args.flight)
        summary = summarise_autopilot(flight)
        for one in summary["flights"]:
            one["maneuvers"] = _maneuvers(source, one["number"], choices)
        print(
            json.dumps(summary, indent=2)
            if args.json
            else "\n".join(map(shown, summary_lines(summary)))
        )
        return int(ExitCode.OK)
    refuse_table(source)
    head = describe(source)
    print(json.dumps(head, indent=2) if args.json else "\n".join(map(shown, head_lines(head))))
    return int(ExitCode.OK)


def _maneuvers(source: Path, number: int, choices: Mapping[str, int | str]) -> int | None:
    """Return how many test points a flight of a log has; None if nothing can be said of it."""
    from host.errors import HostError
    from host.readers.flight_choice import with_flight
    from host.sysid.flight import read_columns
    from host.sysid.maneuvers import detect_maneuvers

    try:
        columns, _ = read_columns(with_flight(source, number), sensors=choices)
    except HostError:
        return None
    return len(detect_maneuvers(columns))


def _table(flights: list[dict[str, Any]]) -> list[str]:
    lines = [f"{'session':>8}  {'bytes':>12}  file"]
    for flight in flights:
        note = "" if flight["recorded"] else "  (prepared, nothing recorded)"
        lines.append(f"{flight['session']:>8}  {flight['size_bytes']:>12}  {flight['file']}{note}")
    return lines
