"""`host simulate`: fly a card in the digital twin and record it."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from host.errors import CheckError, ExitCode, UsageError
from host.extras import install_hint
from host.progress import draw_share

if TYPE_CHECKING:
    from host.aircraft.file import Aircraft

# Faults that leave every decoded value right.
HARMLESS = ("motor_cut", "card_busy")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "simulate",
        help="fly a virtual flight test and record it",
        description="Fly a flight card with a simulated aircraft, air, pilot and sensors. Writes"
        " the log, the truth beside it, the calibration that belongs to it, and a picture."
        " Without a card it lists the cards.",
    )
    parser.add_argument("card", nargs="?", help="name of a card, or a TOML file")
    parser.add_argument("-o", "--output", type=Path, default=Path("flight"), metavar="DIR",
                        help="folder for the files (default: flight)")  # fmt: skip
    parser.add_argument("--seed", type=int, default=1, help="fixes every random number (default 1)")
    parser.add_argument(
        "--firmware",
        choices=("sitl", "avr", "none", "thesis"),
        default="sitl",
        help="who records: the firmware on this computer (default), its Mega image in the chip"
        " simulator, nobody (ideal table), or the thesis's logger",
    )
    parser.add_argument("--aircraft", action="append", default=[], metavar="NAME|FILE",
                        help="fly this aircraft in place of the card's, or what the card's becomes"
                        " with a model of `host identify --save-model`; a model per axis may be"
                        " given")  # fmt: skip
    parser.add_argument("--both", action="store_true",
                        help="the thesis's logger flies along, into the same picture")  # fmt: skip
    parser.add_argument("--faults", action="store_true",
                        help="list the faults a card can name, and fly nothing")  # fmt: skip
    parser.add_argument("--no-picture", action="store_true", help="draw nothing")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fly, and print what was written; return an exit code."""
    try:
        from host.twin.faults import without_recorder
        from host.twin.outcome import report
        from host.twin.recorder import sitl
        from host.twin.testcard import cards
    except ImportError as error:
        raise UsageError(
            f"the virtual flight needs {error.name}: {install_hint(error.name)}"
        ) from None
    if args.faults:
        return _list_faults(as_json=args.json)
    if args.card is None:
        return _list(as_json=args.json)
    card = cards.load(args.card)
    if args.seed < 0:
        raise UsageError(f"seed is {args.seed}, expected 0 or more")
    try:
        outcome = report.simulate(
            card,
            args.output,
            seed=args.seed,
            aircraft=_aircraft(args.aircraft, card.aircraft),
            firmware=args.firmware,
            pictures=not args.no_picture,
            both=args.both,
            progress=draw_share,
        )
    except OSError as error:
        if error.filename is None and error.errno is not None:  # a write, which names no file
            error.filename = f"{args.output}: not all files of the flight were written"
        raise
    record = outcome.record
    for doubt in record.aircraft.doubts:
        print(f"host: {doubt}", file=sys.stderr)
    duration = float(record.t_s[-1])
    planned_s = cards.duration_s(card)
    # The chip simulator is another process: its time is only on the wall.
    spent = outcome.wall_s if args.firmware == "avr" else outcome.processor_s
    busy = sum(s for stage, s in spent.items() if stage not in ("load", "picture"))
    flown = [w for w in record.schedule.windows if w.end_s <= duration]
    if args.json:
        print(
            json.dumps(
                {
                    "card": card.name,
                    "aircraft": record.aircraft.name,
                    "seed": args.seed,
                    "firmware": args.firmware,
                    "duration_s": duration,
                    "ended_on_ground": record.touched_ground,
                    "maneuvers": len(flown),
                    "files": [str(path) for path in outcome.files],
                    "wall_s": outcome.wall_s,
                    "processor_s": outcome.processor_s,
                    "times_real_time": duration / busy,
                    "deviations": {
                        d.column: [d.mean, d.spread, d.mean_limit, d.spread_limit]
                        for d in outcome.deviations
                    },
                }
            )
        )
        return ExitCode.OK
    print(f"{card.title}\n  {record.aircraft.title}, {duration:.1f} s, {len(flown)} maneuvers,"
          f" seed {args.seed}, simulated")  # fmt: skip
    if record.touched_ground:
        print(f"  on the ground after {duration:.1f} s, sinking at {record.sink_mps:.1f} m/s:"
              f" the flight ends there, {card.name} asked for {planned_s:.1f} s")  # fmt: skip
    stages = ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in spent.items())
    print(
        f"  {duration / busy:.0f} times real time on one core, loading and picture apart ({stages})"
    )
    left = without_recorder(card.faults) if outcome.recording is None else []
    if left:
        print(f"  without the recorder nothing comes of {', '.join(f.kind for f in left)}")
    rate_hz = card.flight.rate_hz
    if outcome.recording is not None and rate_hz not in sitl.RATES_HZ:
        print(f"  recorded at {sitl.recorder_rate_hz(rate_hz)} Hz: {rate_hz:g} Hz of the card is"
              f" none of {', '.join(map(str, sitl.RATES_HZ))}")  # fmt: skip
    if outcome.recording is not None and not outcome.recording.log:
        print(f"  nothing was recorded: the recorder found {outcome.recording.name}")
    if outcome.deviations:
        print("  decoded log against the truth, in flight (mean and spread of the error, limits):")
    for d in outcome.deviations:
        verdict = "" if d.within else "  BEYOND ITS ERROR MODEL"
        print(f"    {d.column:14s} {d.mean:+9.4f} {d.spread:8.4f}"
              f"   {d.mean_limit:8.4f} {d.spread_limit:8.4f}{verdict}")  # fmt: skip
    for path in outcome.files:
        print(f"  wrote {path}")
    broken = any(fault.kind not in HARMLESS for fault in card.faults)
    beyond = [d.column for d in outcome.deviations if not d.within]
    if beyond and not broken:
        raise CheckError(f"{', '.join(beyond)}: decoded values are beyond what the sensors explain")
    return ExitCode.OK


def _aircraft(given: list[str], usual: str) -> Aircraft | None:
    from host.aircraft.linear_aircraft import load
    from host.planning.identified_aircraft import is_model, with_models

    models = [Path(name) for name in given if is_model(name)]
    named = [name for name in given if not is_model(name)]
    if len(named) > 1:
        raise UsageError(f"{named[1]}: one aircraft flies, {named[0]} is given already")
    if not given:
        return None
    base = load(named[0] if named else usual)
    return with_models(base, models) if models else base


def _list(*, as_json: bool) -> int:
    from host.twin.testcard import cards

    known = [cards.load(name) for name in cards.names()]
    if as_json:
        print(json.dumps([{"name": c.name, "title": c.title} for c in known]))
        return ExitCode.OK
    print("Cards (host simulate NAME):")
    for card in known:
        print(f"  {card.name:16s} {card.title}")
    return ExitCode.OK


def _list_faults(*, as_json: bool) -> int:
    from host.twin.faults import FAULTS

    if as_json:
        print(json.dumps([{"name": name, **asdict(kind)} for name, kind in FAULTS.items()]))
        return ExitCode.OK
    print("Faults ([[fault]] in a card: kind, at_s, duration_s, value, channel):")
    for name, kind in FAULTS.items():
        more = [f"value {kind.value:g}"] if kind.value else []
        if kind.channels:
            more.append(f"channel {', '.join(kind.channels)}")
        if kind.from_start or not kind.lasts:
            more.append("from power-on" if kind.from_start else "at one instant")
        print(f"  {name:22s} {kind.text}" + (f" ({'; '.join(more)})" if more else ""))
    return ExitCode.OK
