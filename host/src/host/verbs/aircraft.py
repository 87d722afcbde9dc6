"""`host aircraft`: an aircraft file written from what was measured, or checked."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

DO = ("new", "check")


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "aircraft",
        help="write the file of your aircraft, or check one",
        description="new: asks what was measured on the ground, computes what follows from it and"
        " writes the commented file that `--aircraft` takes; never over a file that is there."
        " check: holds a file against what aircraft are.",
        epilog="Without a terminal every answer comes by --set. Exit code 6: a checked file is no"
        " good.",
    )
    parser.add_argument("do", choices=DO, help="new or check")
    parser.add_argument("file", help="mine.toml; check: a packaged name too")
    parser.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], dest="given",
                        help="an answer, such as mass_kg=1.793 or imu_m=0.02,0,0.01;"
                        " repeatable")  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Write or check; return an exit code."""
    from host.errors import ExitCode, UsageError

    given = {}
    for word in args.given:
        key, equals, value = word.partition("=")
        if not equals or not value:
            raise UsageError(f"--set {word}: expected KEY=VALUE, such as mass_kg=1.793")
        given[key] = value
    if args.do == "check":
        if given:
            raise UsageError("host aircraft check takes no --set")
        return _checked(args.file)
    _write(Path(args.file), given)
    return int(ExitCode.OK)


def _write(path: Path, given: dict[str, str]) -> None:
    from host.aircraft.file import load_measured
    from host.aircraft.measured_form import ask_for, filled_form, questions
    from host.errors import UsageError
    from host.export.atomic_files import atomic_write

    if path.exists():
        raise UsageError(f"{path} is there already: name another file")
    if path.suffix != ".toml":
        raise UsageError(f"{path}: expected a name that ends in .toml")
    if sys.stdin.isatty():
        ask_for(questions(), given, input)
    text = filled_form(given)
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")
        doubts = load_measured(part).doubts
    for doubt in doubts:
        print(f"host: {doubt}", file=sys.stderr)
    print(f"wrote {path}; host aircraft check {path} says it again")


def _checked(source: str) -> int:
    from host.aircraft.file import AircraftError, load_measured, read_document
    from host.errors import ExitCode

    try:
        found = load_measured(source)
        measured = read_document(source).get("kind") == "measured"
    except AircraftError as error:
        print(f"host: {error}", file=sys.stderr)
        return int(ExitCode.CHECK)
    numbers = found.scalars
    print(f"{found.title}: {numbers['mass.mass_kg']:g} kg, span {numbers['geometry.span_m']:g} m")
    for doubt in found.doubts:
        print(f"look again: {doubt}")
    less = "; plan and simulate want aerodynamics, or a file of sizes (START.md, step 8)"
    print("good for host identify, preflight and live" + (less if measured else ", plan, simulate"))
    return int(ExitCode.OK)
