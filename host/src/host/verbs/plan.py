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

if TYPE_CHECKING:
    from host.planning.card_planning import Plan, Point

# A derivative whose predicted half-width is above this is named.
WEAK_PERCENT = 20.0


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "plan",
        help="judge planned maneuvers before they are flown",
        description="Print a flight card for the knee board: inputs, pulse times, amplitudes,"
        " expected excursions and the accuracy its data will allow. Without a card one is designed"
        " for the aircraft from its prior model.",
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
    parser.add_argument("--save", type=Path, metavar="FILE", help="write the designed card as TOML")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Judge or design a card and print it; return an exit code."""
    try:
        from host.aircraft.aircraft_ranges import AIRSPEED
        from host.export.toml import dumps
        from host.planning import card_planning as planning
        from host.twin.testcard import cards
    except ImportError as error:
        raise UsageError(f"planning needs {error.name}: {install_hint(error.name)}") from None
    if args.airspeed is not None:
        AIRSPEED.check("--airspeed", args.airspeed, UsageError)
    if args.card is None:
        card = planning.design(args.aircraft or "ultrastick25e", args.airspeed or 0.0)
        if args.save is not None:
            _save(args.save, dumps(planning.document(card)))
    elif args.save is not None:
        raise UsageError("--save goes with a designed card: leave the card's name out")
    else:
        card = cards.load(args.card)
        card = replace(card, aircraft=args.aircraft or card.aircraft)
        speed = args.airspeed or card.flight.airspeed_mps
        card = replace(card, flight=replace(card.flight, airspeed_mps=speed))
    plan = planning.judge(card)
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
                    "bounds": [asdict(bound) for bound in plan.bounds],
                    "refused": plan.refused,
                }
            )
        )
        return ExitCode.OK
    _print(plan)
    if args.save is not None:
        print(f"wrote {args.save}; fly it with: {command_line('host', 'simulate', args.save)}")
    return ExitCode.OK


def _save(path: Path, text: str) -> None:
    from host.sysid.answer.atomic_files import atomic_write, check_destination

    if path.suffix != ".toml":
        raise UsageError(f"--save {path}: ends in '{path.suffix}', expected .toml")
    check_destination("--save", path, folder=False)
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def _print(plan: Plan) -> None:
    print(f"{plan.card.title}  [{plan.aircraft.title}, predicted, calm air, exact inputs]\n")
    print("  n  input                     amplitude  pulse   test   dV     alpha  beta   p      q "
          "     r      bank   pitch  load")  # fmt: skip
    print("                                 deg         s      s     m/s    deg    deg    deg/s  "
          "deg/s  deg/s  deg    deg    g")  # fmt: skip
    last: Point | None = None
    count = 0
    rows: list[tuple[int, Point]] = []
    for point in plan.points:
        same = last is not None and (point.kind, point.axes, point.amplitudes, point.width_s) == (
            last.kind, last.axes, last.amplitudes, last.width_s,
        )  # fmt: skip
        count = count + 1 if same else 1
        if same:
            rows.pop()
        rows.append((count, point))
        last = point
    for times, p in rows:
        name = f"{p.kind} {'+'.join(p.axes)}"
        size = "/".join(f"{a:g}" for a in p.amplitudes)
        pulse = f"{p.width_s:5.2f}" if p.width_s else "  -  "
        low, high = p.load_factor
        print(
            f"  {times}x {name:24s} {size:>10s}  {pulse}  {p.duration_s:5.1f}"
            f"  {p.airspeed_mps:5.1f}  {p.alpha_deg:5.1f}  {p.beta_deg:5.1f}"
            f"  {p.roll_rate_degps:5.0f}  {p.pitch_rate_degps:5.0f}  {p.yaw_rate_degps:5.0f}"
            f"  {p.bank_deg:5.0f}  {p.pitch_deg:5.0f}  {low:4.1f} to {high:3.1f}"
        )
    print("\n  What the data will tell, at best (white sensor noise only, 95 % half-width):")
    for b in plan.bounds:
        weak = "  weak: fly more of it, or larger" if b.percent > WEAK_PERCENT else ""
        print(
            f"    {b.name:8s} {b.value:+10.4g} +- {b.half_width:8.2g}  ({b.percent:5.1f} %){weak}"
        )
    for text in plan.refused:
        print(f"    {text}")
