"""`host simulate`: fly a card in the digital twin and record it."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from host.errors import ExitCode, UsageError
from host.extras import install_hint
from host.progress import draw_share


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "simulate",
        help="fly a virtual flight test and record it",
        description="Fly a flight card with a simulated aircraft, air, pilot and sensors. Writes"
        " the log, its truth, the calibration that belongs to it, and a picture."
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
    parser.add_argument("--flight-card", type=Path, metavar="FILE",
                        help="the logger flies the card's inputs, by this file of `host plan"
                        " CARD --card FILE`; the pilot only enables and triggers them")  # fmt: skip
    parser.add_argument("--both", action="store_true",
                        help="the thesis's logger flies along, into the same picture")  # fmt: skip
    parser.add_argument("--faults", action="store_true",
                        help="list the faults a card can name, and fly nothing")  # fmt: skip
    parser.add_argument("--to", action="append", choices=("ulog", "dataflash", "tlog"), default=[],
                        help="write the log of a PX4 or ArduPilot plane of the same flight too;"
                        " repeatable")  # fmt: skip
    parser.add_argument("--outputs", choices=("conventional", "elevons", "vtail"),
                        default="conventional", help="with --to: surfaces of that plane"
                        " (default: conventional)")  # fmt: skip
    parser.add_argument("--no-picture", action="store_true", help="draw nothing")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fly, and print what was written; return an exit code."""
    from host.twin.recorder.recorder_build import check_recorder, recorder_library

    flies = args.card is not None and not args.faults
    if flies and args.firmware == "sitl":
        check_recorder()  # before numpy: without a compiler the answer comes at once
    try:
        from host.twin.outcome import flight_outcome, outcome_summary
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
    from host.aircraft.origin import announce_aircraft
    from host.compiled import say_if_slow
    from host.planning.identified_aircraft import is_model, named_aircraft
    from host.wire.flight_card import card_file

    say_if_slow()  # before the recorder is built
    if args.firmware == "sitl":
        recorder_library(draw_share)
    try:
        outcome = flight_outcome.simulate(
            card,
            args.output,
            seed=args.seed,
            aircraft=named_aircraft(args.aircraft, card.aircraft),
            firmware=args.firmware,
            pictures=not args.no_picture,
            both=args.both,
            logs=args.to,
            airframe=args.outputs,
            flight_card=b"" if args.flight_card is None else card_file(args.flight_card),
            progress=draw_share,
        )
    except OSError as error:
        if error.filename is None and error.errno is not None:  # a write, which names no file
            error.filename = f"{args.output}: not all files of the flight were written"
        raise
    announce_aircraft(name for name in args.aircraft if not is_model(name))
    for doubt in outcome.record.aircraft.doubts:
        print(f"host: {doubt}", file=sys.stderr)
    if outcome.missing:
        print(f"host: no picture without {outcome.missing}: {install_hint(outcome.missing)}",
              file=sys.stderr)  # fmt: skip
    if args.json:
        print(json.dumps(outcome_summary.document(outcome, args.firmware)))
        return ExitCode.OK
    print("\n".join(outcome_summary.lines(outcome, args.firmware)))
    outcome_summary.check(outcome)
    return ExitCode.OK


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
