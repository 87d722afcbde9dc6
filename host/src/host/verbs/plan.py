"""`host plan`: judge a flight card before it is flown, or design one from a prior model."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from host.errors import ExitCode, UsageError
from host.extras import install_hint
from host.terminal import command_line
from host.verbs._plan_lines import (
    NO_SIGN_PERCENT,
    point_as_json,
    print_intervals,
    print_plan,
    print_single_points,
)

if TYPE_CHECKING:
    from host.aircraft.file import Aircraft
    from host.planning.point_widths import PointPromise
    from host.planning.predicted_widths import Prediction
    from host.twin.testcard.cards import Card

MOST_FLIGHTS = 100
MOST_GUSTS_MPS = 5.0


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "plan",
        help="judge planned maneuvers before they are flown",
        description="Print a flight card for the knee board: inputs, pulse times, amplitudes,"
        " expected excursions and the intervals that identification will give. Without a card one"
        " is designed for the aircraft from its prior model.",
    )
    parser.add_argument("card", nargs="?", help="name of a card, or a TOML file")
    parser.add_argument(
        "--aircraft",
        metavar="NAME|FILE",
        help="for this aircraft (default: the card's, else ultrastick25e)",
    )
    parser.add_argument(
        "--airspeed",
        type=float,
        metavar="MPS",
        help="for this airspeed (default: the card's, else the aircraft file's)",
    )
    parser.add_argument(
        "--gusts",
        type=float,
        metavar="MPS",
        help="standard deviation of the vertical gust (default: the card's, else 0.3)",
    )
    parser.add_argument(
        "--flights",
        type=int,
        default=3,
        metavar="N",
        help="virtual flights whose median gives the intervals (default 3);"
        " 0: only the bounds of white noise in calm air, at once",
    )
    parser.add_argument(
        "--alone",
        action="store_true",
        help="print the half-widths of each test point alone too, the reference of its verdict in"
        " flight (host live)",
    )
    _add_designs(parser)
    parser.add_argument("--save", type=Path, metavar="FILE", help="write the designed card as TOML")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    parser.set_defaults(run=run)


def _add_designs(parser: argparse.ArgumentParser) -> None:
    """Add the options of designed cards and of the logger's file."""
    parser.add_argument(
        "--optimal",
        action="store_true",
        help="design multisines on all axes at once that reach the wanted half-widths in the least"
        " time, for aircraft of the prior's range",
    )
    parser.add_argument(
        "--prior",
        type=Path,
        action="append",
        metavar="FILE",
        help="with --optimal: coefficients of AVL, Datcom or TOML in place of the aircraft's, or"
        " models of host identify --save-model, one of each axis, with their intervals",
    )
    parser.add_argument(
        "--want",
        type=float,
        default=10.0,
        metavar="PERCENT",
        help="with --optimal: half-width that noise and gusts may leave (default 10)",
    )
    parser.add_argument(
        "--card",
        dest="logger_card",
        type=Path,
        metavar="FILE",
        help="write the inputs for the logger to fly, such as flight.card (host card write)",
    )
    parser.add_argument(
        "--hold",
        type=Path,
        metavar="TOML",
        help="with --card: gains of host tune --for mega; rows then hold bank and pitch where they"
        " do not move their surface, and teach nothing in flight",
    )
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="TOML",
        help="with --card: calibration of the logger (default: the one of the package)",
    )
    parser.add_argument(
        "--amplitude",
        type=float,
        default=1.0,
        metavar="SHARE",
        help="with --card: factor on all deflections, such as 0.33 on first flights (default 1)",
    )


def run(args: argparse.Namespace) -> int:
    """Judge or design a card and print it; return an exit code."""
    try:
        from host.aircraft.origin import announce_aircraft
        from host.export.toml import dumps
        from host.planning import card_design
        from host.planning import card_planning as planning
        from host.planning.home_turns import turns_before
        from host.twin.testcard import cards
    except ImportError as error:
        raise UsageError(f"planning needs {error.name}: {install_hint(error.name)}") from None
    _check(args)
    if args.optimal or args.prior:
        card = _optimal(args)
    elif args.card is None:
        card = card_design.design(args.aircraft or "ultrastick25e", args.airspeed or 0.0)
    if args.card is None:
        if args.save is not None:
            _save(args.save, dumps(card_design.document(card)))
    elif args.save is not None:
        raise UsageError("--save goes with a designed card: leave the card's name out")
    else:
        card = cards.load(args.card)
        card = replace(card, aircraft=args.aircraft or card.aircraft)
        speed = args.airspeed or card.flight.airspeed_mps
        card = replace(card, flight=replace(card.flight, airspeed_mps=speed))
    if args.logger_card is not None:
        _write_logger_card(card, args)
    plan = planning.judge(card)
    announce_aircraft([args.aircraft])
    prediction = _predicted(card, args) if args.flights else None
    alone = _single_points(card, args) if args.flights and args.alone else []
    for doubt in plan.aircraft.doubts:
        print(f"host: {doubt}", file=sys.stderr)
    if args.json:
        print(
            json.dumps(
                {
                    "card": card.name,
                    "title": card.title,
                    "aircraft": plan.aircraft.name,
                    "points": [asdict(point) for point in plan.points],
                    "turns_before": turns_before(card),
                    "bounds": [asdict(bound) for bound in plan.bounds],
                    "refused": plan.refused,
                    "predicted": None if prediction is None else asdict(prediction),
                    "alone": [point_as_json(point) for point in alone],
                }
            )
        )
        return ExitCode.OK
    print_plan(plan)
    print_intervals(plan, prediction)
    print_single_points(alone)
    if args.save is not None:
        print(f"wrote {args.save}; fly it with: {command_line('host', 'simulate', args.save)}")
    return ExitCode.OK


def _check(args: argparse.Namespace) -> None:
    """Refuse wrong arguments before anything is designed or flown."""
    from host.aircraft.aircraft_ranges import AIRSPEED
    from host.export.atomic_files import check_destination

    if args.airspeed is not None:
        AIRSPEED.check("--airspeed", args.airspeed, UsageError)
    if not 0 <= args.flights <= MOST_FLIGHTS:
        raise UsageError(f"--flights is {args.flights}, expected 0 to {MOST_FLIGHTS}")
    if args.gusts is not None and not 0.0 <= args.gusts <= MOST_GUSTS_MPS:
        raise UsageError(f"--gusts is {args.gusts:g} m/s, expected 0 to {MOST_GUSTS_MPS:g}")
    if not 0.01 <= args.amplitude <= 1.0:
        raise UsageError(f"--amplitude is {args.amplitude:g}, expected 0.01 to 1")
    if args.logger_card is not None and args.card is None and args.aircraft is None:
        raise UsageError(
            "--card is flown by the logger: name the aircraft it is designed for, --aircraft FILE"
        )
    if args.hold is not None and args.logger_card is None:
        raise UsageError("--hold is of the logger's file: name it, --card FILE")
    if args.logger_card is not None:
        check_destination("--card", args.logger_card, folder=False)
    if args.save is not None and args.save.suffix != ".toml":
        raise UsageError(f"--save {args.save}: ends in '{args.save.suffix}', expected .toml")
    if args.save is not None:
        check_destination("--save", args.save, folder=False)


def _optimal(args: argparse.Namespace) -> Card:
    """Design the card of the least time; print its predicted half-widths on stderr."""
    from host.aircraft.linear_aircraft import load
    from host.planning.identified_aircraft import identified_range, is_model
    from host.planning.optimal_card import AIRCRAFT, optimal_card, prior_of

    if args.card is not None or not args.optimal:
        raise UsageError(
            "--optimal designs a card, --prior goes with it: leave the card's name out"
        )
    if not 0.1 <= args.want <= NO_SIGN_PERCENT:
        raise UsageError(f"--want is {args.want:g} %, expected 0.1 to {NO_SIGN_PERCENT:g}")
    source = args.aircraft or "ultrastick25e"
    aircraft = load(source)
    fleet: list[Aircraft] = []
    priors = args.prior or []
    if priors and all(map(is_model, priors)):
        fleet = identified_range(aircraft, priors, AIRCRAFT)
        aircraft = fleet[0]
        speed = aircraft.scalar("trim.airspeed_mps")
        if abs((args.airspeed or speed) - speed) > 0.05 * speed:
            raise UsageError(
                f"--airspeed {args.airspeed:g}: {priors[0]} is about {speed:.1f} m/s, and says"
                " nothing of another airspeed"
            )
        print(f"host: {aircraft.title}: drawn from their intervals", file=sys.stderr)
    elif len(priors) > 1:
        raise UsageError(
            "--prior: coefficients are of one file; models of one axis each may be two"
        )
    elif priors:
        aircraft, replaced = prior_of(aircraft, priors[0], args.airspeed or 0.0)
        print(f"host: {priors[0]}: {', '.join(replaced)}", file=sys.stderr)
    found = optimal_card(
        aircraft,
        args.airspeed or 0.0,
        gusts_mps=0.3 if args.gusts is None else max(args.gusts, 0.05),
        wanted_share=0.01 * args.want,
        fleet=fleet,
    )
    print(f"host: {found.line()}", file=sys.stderr)
    return replace(found.card, aircraft=source)


def _write_logger_card(card: Card, args: argparse.Namespace) -> None:
    """Write the file that `host card write` puts into the logger."""
    from host.aircraft.linear_aircraft import load
    from host.export.atomic_files import atomic_write
    from host.physical.calibration import load_calibration
    from host.planning.flight_envelope import Envelope
    from host.planning.hold_card import read_gains
    from host.planning.learning_card import learned_axes
    from host.planning.logger_card import logger_card
    from host.wire.card_text import card_lines
    from host.wire.flight_card import read_card

    calibration = load_calibration(args.calibration)
    if calibration.lines["pulse.elevator"].default:
        print(
            "host: pulses of the default calibration: calibrate the servos before this card flies",
            file=sys.stderr,
        )
    plane = load(card.aircraft)
    # A linear aircraft has accelerations only: its inertia and coefficients cannot be separated.
    learned = [] if plane.straight is not None else learned_axes(card.aircraft, card, calibration)
    envelope = Envelope(amplitude_share=args.amplitude)
    hold = None if args.hold is None else read_gains(args.hold)
    data = logger_card(card, plane, calibration, envelope, learned, hold)
    with atomic_write(args.logger_card) as part:
        part.write_bytes(data)
    print("\n".join(card_lines(read_card(data))))
    print(f"wrote {args.logger_card}\n")


def _save(path: Path, text: str) -> None:
    from host.export.atomic_files import atomic_write

    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def _predicted(card: Card, args: argparse.Namespace) -> Prediction:
    """Fly the card virtually, with a bar: one flight takes some seconds."""
    from host.planning.predicted_widths import predict_widths
    from host.progress import draw_share
    from host.terminal import bar

    draw_share("flying", 0.0)
    found = predict_widths(
        card,
        args.gusts,
        flights=args.flights,
        progress=lambda share: draw_share("flying", share),
    )
    bar.clear()
    return found


def _single_points(card: Card, args: argparse.Namespace) -> list[PointPromise]:
    """Fly each different test point by itself."""
    from host.planning.point_widths import promise_points
    from host.progress import draw_share
    from host.terminal import bar

    found = promise_points(
        card,
        args.gusts,
        flights=args.flights,
        progress=lambda share: draw_share("points alone", share),
    )
    bar.clear()
    return found
