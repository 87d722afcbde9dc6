"""`host tune`: gains for an autopilot from a log or saved models."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from host.control import Tuning


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "tune",
        help="find gains for an autopilot that keep their margins",
        description="Identify a log, or read saved models, and find the fastest gains of roll and"
        " pitch that keep 6 dB and 45 degrees in 135 aircraft drawn from the answer.",
    )
    parser.add_argument("source", nargs="+", metavar="SOURCE",
                        help="log, or models of `host identify --save-model`")  # fmt: skip
    parser.add_argument("--aircraft", required=True, metavar="NAME",
                        help="aircraft file: travel of surfaces, servo, span, speeds")  # fmt: skip
    parser.add_argument("--for", dest="autopilot", default="ardupilot", metavar="NAME",
                        help="autopilot: ardupilot, px4, inav, or mega, the hold of the"
                        " logger")  # fmt: skip
    parser.add_argument("--parameters", type=Path, metavar="FILE",
                        help="the autopilot's parameters as the ground station saves them; a log"
                        " of it has its own")  # fmt: skip
    parser.add_argument("--release", default="", metavar="N",
                        help="the autopilot's release, such as 4.5; a log of it names its"
                        " own")  # fmt: skip
    parser.add_argument("--airspeed", type=float, action="append", default=[], metavar="MPS",
                        help="airspeed that the gains hold at; repeatable (default: least, trim"
                        " and largest of the aircraft file)")  # fmt: skip
    parser.add_argument("--save", type=Path, metavar="FILE",
                        help="write changed parameters as FILE, the old ones as"
                        " FILE-before")  # fmt: skip
    parser.add_argument("--plots", type=Path, metavar="DIR",
                        help="write a picture of each axis")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Tune and print."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from host.aircraft.origin import announce_aircraft
    from host.control import (
        ControlError,
        check_asked,
        read_parameters,
        release_in,
        tune,
    )
    from host.errors import ExitCode
    from host.export.atomic_files import check_destination
    from host.planning.identified_aircraft import is_model
    from host.readers.autopilot_flight import is_autopilot_log, read_autopilot
    from host.sysid.pipeline import identify

    # Before minutes of work.
    check_asked(args.autopilot, args.release, args.airspeed)
    if args.save is not None:
        check_destination("--save", args.save, folder=False)
    if args.plots is not None:
        check_destination("--plots", args.plots, folder=True)
    announce_aircraft([args.aircraft])
    logged = read_parameters(args.parameters) if args.parameters else {}
    models = [one for one in args.source if is_model(one)]
    if models and len(models) < len(args.source):
        raise ControlError("SOURCE names models and logs, expected one kind")
    first, release = Path(args.source[0]), args.release
    if not models and not (logged and release) and is_autopilot_log(first):
        log = read_autopilot(first).log
        if log.autopilot == args.autopilot:
            logged = logged or dict(log.parameters)
            release = release or release_in(log.firmware)
        elif not logged:
            print(
                f"host: {first} is a log of {log.autopilot}, gains are for {args.autopilot}:"
                " its parameters are left out; name the others with --parameters",
                file=sys.stderr,
            )
    check_asked(args.autopilot, release, args.airspeed)
    source: Any = models or identify(args.source, aircraft=args.aircraft)
    found = tune(
        source,
        aircraft=args.aircraft,
        autopilot=args.autopilot,
        parameters=logged,
        airspeeds_mps=args.airspeed,
        release=release,
    )
    print(json.dumps(found.document(), indent=2) if args.json else found.to_text())
    _write(args, found)
    return int(ExitCode.OK)


def _write(args: argparse.Namespace, found: Tuning) -> None:
    """Write parameters, the way back and pictures where they are asked for."""
    from host.export.atomic_files import atomic_write

    if args.save is not None:
        before = args.save.with_name(f"{args.save.stem}-before{args.save.suffix}")
        texts = {args.save: found.to_param()}
        if found.autopilot.words:
            texts[before] = found.to_restore()
        for place, text in texts.items():
            with atomic_write(place) as unfinished:
                unfinished.write_text(text, encoding="utf-8")
        print(f"wrote {', '.join(map(str, texts))}", file=sys.stderr)
    if args.plots is not None:
        for axis, figure in found.plot().items():
            with atomic_write(args.plots / f"tune_{axis}.svg") as unfinished:
                figure.savefig(unfinished)
        print(f"wrote {args.plots}", file=sys.stderr)
