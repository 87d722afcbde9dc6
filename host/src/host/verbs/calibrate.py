"""`host calibrate`: counts to SI of this instrument, measured on the bench."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.errors import ExitCode, UsageError
from host.terminal import bare

if TYPE_CHECKING:
    from host.bench_calibration.bench_plan import Subject

_DESCRIPTION = """\
Calibrate a sensor: held positions in, zero and slope with their deviations out, into a dated
calibration file that `host decode --calibration` and `host identify` take. Without SUBJECT it
lists what there is, without SOURCE it says what to do. SOURCE is the logger itself (usb, or its
port: COM5, /dev/ttyACM0), a CSV table, a log recorded on the bench, what a ground station received,
or - to type the readings; another is another repeat.
"""
_EPILOG = """\
exit codes: 0 ok, 2 usage, 4 not a log, 5 no logger at the port, 6 a channel is doubted (it is not
written), or --check found lines that moved
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "calibrate",
        help="measure zero and slope of every sensor on the bench",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "subject", nargs="?", metavar="SUBJECT",
        help="vanes, pots, servos, throttle, pitots, speed, accelerometers, gyros, magnetometer,"
        " supply, inertia, or one channel such as alpha_a; with --check: the newer file",
    )  # fmt: skip
    parser.add_argument("sources", nargs="*", type=Path, metavar="SOURCE", help="see above")
    parser.add_argument("--template", type=Path, metavar="CSV", help="write the table to fill in")
    parser.add_argument(
        "--into", type=Path, metavar="FILE",
        help="calibration file to write; lines it has of other channels stay",
    )  # fmt: skip
    parser.add_argument("--check", type=Path, metavar="OLD", help="compare with an older file")
    parser.add_argument(
        "--instrument", default="instrument", metavar="NAME", help="instrument, for the file's name"
    )
    parser.add_argument("--date", default="", metavar="YYYY-MM-DD", help="date (default: today)")
    parser.add_argument("--by", default="", metavar="WHO", help="name to keep with every line")
    parser.add_argument(
        "--serial",
        action="append",
        default=[],
        metavar="CHANNEL=TEXT",
        help="serial number of a sensor",
    )
    parser.add_argument("--temperature", type=float, metavar="DEGC", help="air on the bench")
    _add_bench_options(parser)
    parser.add_argument("--picture", type=Path, metavar="SVG", help="default: next to the file")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def _add_bench_options(parser: argparse.ArgumentParser) -> None:
    """Add what the bench set: positions, gravity, air, turns, masses."""
    parser.add_argument(
        "--positions",
        default="",
        metavar="LIST",
        help="positions of one round (default: the plan's)",
    )
    parser.add_argument("--latitude", type=float, metavar="DEG", help="latitude, for local gravity")
    parser.add_argument(
        "--density", type=float, metavar="KGPM3", help="air density of a speed run (default 1.225)"
    )
    parser.add_argument(
        "--turn",
        type=float,
        default=3600.0,
        metavar="DEG",
        help="angle by which the gyros are turned (default 3600)",
    )
    parser.add_argument(
        "--was",
        type=float,
        metavar="MV",
        help="reference stored in the board when the status line was read",
    )
    parser.add_argument(
        "--mass",
        type=float,
        nargs=2,
        metavar=("KG", "SIGMA"),
        help="mass on the threads, and the scale's deviation",
    )
    parser.add_argument(
        "--cg-tolerance",
        type=float,
        default=0.010,
        metavar="M",
        help="CG tolerance for the aircraft file (default 0.010)",
    )


def run(args: argparse.Namespace) -> int:
    """List, guide, calibrate or compare; return the exit code."""
    from host.bench_calibration.bench_plan import find_subject

    if args.check is not None and not args.sources:
        return _check(args, Path(args.subject) if args.subject else None)
    if args.subject is None:
        return _list(args)
    subject, channel = find_subject(args.subject)
    if args.template is not None:
        return _template(args.template, subject, channel)
    if not args.sources:
        return _guide(args, subject, channel)
    code = _calibrate(args, subject, channel)
    return code if args.check is None or code else _check(args, _written(args))


def _list(args: argparse.Namespace) -> int:
    from host.bench_calibration.bench_plan import subjects
    from host.terminal import command_line

    if args.json:
        print(json.dumps({name: list(s.channels) for name, s in subjects().items()}))
        return ExitCode.OK
    print("What is calibrated, in this order:\n")
    for name, subject in subjects().items():
        tools = [t.name.replace("_", " ") for t in (subject.tool, subject.turntable) if t]
        print(f"  {name:15s} {', '.join(subject.channels):61s} {', '.join(tools)}".rstrip())
    print(f"\nWhat to do for one of them: {command_line('host', 'calibrate', 'vanes')}")
    return ExitCode.OK


def _guide(args: argparse.Namespace, subject: Subject, channel: str) -> int:
    from host.terminal import command_line

    steps = subject.steps_for(channel)
    if args.json:
        print(json.dumps({"subject": subject.name, "steps": steps}))
        return ExitCode.OK
    for number, step in enumerate(steps, start=1):
        print(f"{number}. {step}")
    word = channel or subject.name
    table = f"{word}.csv"
    print(f"\nA table to fill in: {command_line('host', 'calibrate', word, '--template', table)}")
    print(f"then: {command_line('host', 'calibrate', word, table)}")
    if subject.table in ("channel", "pulse"):
        one = channel or subject.channels[0]
        print(f"from a recording: {command_line('host', 'calibrate', one, 'FLT00003.BIN')}")
        print(f"or typed: {command_line('host', 'calibrate', one, '-')}")
    return ExitCode.OK


def _template(path: Path, subject: Subject, channel: str) -> int:
    from host.bench_calibration.reading_table import empty_table

    if path.exists():
        raise UsageError(f"{path}: is there already; it may hold readings. Name another file")
    path.write_text(empty_table(subject, channel), encoding="utf-8")
    print(f"wrote {path}: fill in what was read, leave out rows that were not")
    return ExitCode.OK


def _calibrate(args: argparse.Namespace, subject: Subject, channel: str) -> int:
    from host.bench_calibration.bench_plan import AIR_KGPM3
    from host.bench_calibration.bench_session import Bench, calibrate
    from host.bench_calibration.supply_reference import NOMINAL_MV
    from host.text import shown

    bench = Bench(
        subject=subject,
        channel=channel,
        sources=tuple(args.sources),
        positions=_positions(args.positions),
        instrument=args.instrument,
        day=_day(args.date),
        by=args.by,
        serials=_serials(args.serial, subject),
        temperature_degc=_finite("--temperature", args.temperature),
        latitude_deg=_finite("--latitude", args.latitude),
        density_kgpm3=_finite("--density", args.density) or AIR_KGPM3,
        turn_deg=abs(_finite("--turn", args.turn) or 3600.0),
        was_mv=_finite("--was", args.was) or NOMINAL_MV,
        mass_kg=tuple(args.mass) if args.mass else None,
        cg_tolerance_m=_finite("--cg-tolerance", args.cg_tolerance) or 0.010,
        into=args.into,
        picture=args.picture,
    )
    result = calibrate(
        bench, _ask, lambda line: print(line, file=sys.stderr), _show if _watched() else None
    )
    if args.json:
        print(json.dumps(result.data))
    else:
        print("\n".join(map(shown, result.lines)))
    return result.exit_code


def _check(args: argparse.Namespace, new: Path | None) -> int:
    from host.bench_calibration.calibration_check import compare, newest_calibration
    from host.physical.calibration import load_calibration
    from host.text import shown

    path = new or newest_calibration(Path(), args.check)
    moved = compare(load_calibration(args.check), load_calibration(path))
    beyond = [one for one in moved if one.beyond]
    if args.json:
        rows = [{"line": m.line, "what": m.what, "old": m.old, "new": m.new,
                 "sigmas": m.sigmas if math.isfinite(m.sigmas) else None, "moved": m.beyond}
                for m in moved]  # fmt: skip
        print(json.dumps({"old": str(args.check), "new": str(path), "numbers": rows}))
        return ExitCode.CHECK if beyond else ExitCode.OK
    print(shown(f"{args.check} -> {path}"))
    for m in moved:
        word = "MOVED" if m.beyond else "same"
        print(f"  {shown(m.line):26s} {m.what:8s} {m.old:12.6g} -> {m.new:12.6g}"
              f"  {m.sigmas:+6.1f} sigma  {word}")  # fmt: skip
    if not moved:
        print("  no line that somebody measured for both")
    elif beyond:
        print(f"{len(beyond)} of {len(moved)} numbers moved by more than their 95 %; one in 20"
              " does so by chance")  # fmt: skip
    else:
        print(f"all {len(moved)} numbers agree within their 95 %")
    return ExitCode.CHECK if beyond else ExitCode.OK


def _written(args: argparse.Namespace) -> Path | None:
    return Path(args.into) if args.into is not None else None


def _ask(question: str) -> str:
    print(question, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline()


def _watched() -> bool:
    return sys.stderr.isatty() and sys.stdin.isatty()


def _show(line: str) -> None:
    """Write a question again over itself, with the present reading."""
    bare(sys.stderr).write(f"\r{line}\033[K")
    sys.stderr.flush()


def _positions(text: str) -> tuple[float, ...]:
    try:
        found = tuple(float(p) for p in text.split(",")) if text else ()
    except ValueError:
        found = (math.nan,)
    if not all(math.isfinite(p) for p in found):
        raise UsageError(f"--positions {text}: expected numbers such as 0,10,20,10,0")
    return found


def _day(text: str) -> str:
    from datetime import date

    try:
        return date.fromisoformat(text).isoformat() if text else ""
    except ValueError:
        raise UsageError(f"--date {text}: expected YYYY-MM-DD") from None


def _serials(words: list[str], subject: Subject) -> dict[str, str]:
    pairs = [word.partition("=") for word in words]
    for channel, equals, text in pairs:
        if channel not in subject.channels or not equals or not text:
            raise UsageError(
                f"--serial {channel}{equals}{text}: expected CHANNEL=TEXT with a channel of"
                f" {', '.join(subject.channels)}"
            )
    return {channel: text for channel, _, text in pairs}


def _finite(option: str, value: float | None) -> float | None:
    if value is not None and not math.isfinite(value):
        raise UsageError(f"{option} {value}: expected a number")
    return value
