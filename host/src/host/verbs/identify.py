"""`host identify`: from a flight to a model, its uncertainty, and what to trust of it."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.decode.newest_flight import source_or_newest
from host.placed_arguments import (
    StoreOnce,
    StorePlaced,
    flattened,
    of_each,
    of_each_flight,
    stretches_of_each,
)
from host.source_arguments import add_data_choices, add_flight

if TYPE_CHECKING:
    from host.sysid.answer import OutputPaths


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "identify",
        help="estimate the aircraft's derivatives with their uncertainty",
        description="Find the maneuvers of a flight, fit a model to them jointly, check it on"
        " maneuvers it has not seen, and say what of it can be trusted.",
    )
    parser.add_files("log (also of PX4, ArduPilot), CSV, Parquet, MAT; several are fitted together;"
                     " without one the newest flight of the working folder. --from"
                     " and --to belong to the source before them")  # fmt: skip
    parser.add_argument("--map", type=Path, metavar="TOML", action=StorePlaced, default=[],
                        help="foreign names, units and signs: a file, or the name of a shipped map"
                        " ('list' shows them); once for all sources, or behind each that needs"
                        " one")  # fmt: skip
    parser.add_argument("--calibration", type=Path, metavar="TOML", action=StorePlaced, default=[],
                        help="calibration of a log; as --map")  # fmt: skip
    parser.add_argument(
        "--model",
        action="append",
        metavar="NAME",
        help="longitudinal, lateral, short-period, phugoid, roll, dutch-roll, one of the thesis"
        " ('list' shows them) or a TOML file;"
        " 'coefficients' (with --aircraft) fits lift, drag, side force and moments directly,"
        " a TOML file of kind 'coefficients' with terms of its own;"
        " repeatable (default: longitudinal and lateral)",
    )
    parser.add_argument(
        "--method",
        action="append",
        metavar="NAME",
        help="estimator, repeatable for a side-by-side table; 'list' shows them",
    )
    parser.add_argument("--method-option", action="append", metavar="NAME=VALUE",
                        help="option of a method, which 'list' in place of the method"
                        " shows")  # fmt: skip
    parser.add_argument("--history", type=Path, metavar="FILE",
                        help="write how the estimate of an iterative or recursive method"
                        " settled as .csv")  # fmt: skip
    parser.add_argument("--aircraft", metavar="NAME", help="aircraft file: mass, sizes, sensors;"
                        " gives coefficients")  # fmt: skip
    parser.add_argument("--truth", type=Path, metavar="TOML", action=StorePlaced, default=[],
                        help="truth of a simulated flight: compare with it; of several flights"
                        " one each")  # fmt: skip
    parser.add_argument("--prior", type=Path, metavar="FILE",
                        help="coefficients to compare with: TOML, AVL, Datcom, an"
                        " aircraft")  # fmt: skip
    _add_data(parser)
    _add_outputs(parser)


def _add_data(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--from", dest="ends", type=float, metavar="S",
                        action=StorePlaced, const=0, default=[],
                        help="start of a stretch of the source before it: fitted whatever moved"
                        " in it, in place of the maneuvers found; repeatable")  # fmt: skip
    parser.add_argument("--to", dest="ends", action=StorePlaced, const=1, type=float, metavar="S",
                        default=[], help="end of it")  # fmt: skip
    add_data_choices(parser)
    add_flight(parser, every=True)
    parser.add_argument("--no-delays", action="store_true",
                        help="estimate no delay of a sensor")  # fmt: skip


def _add_outputs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--full", action="store_true", help="print every number: constants,"
                        " sensors' errors, delays, fit, causes")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--mat", type=Path, metavar="FILE", action=StoreOnce,
                        help="write a MAT file")  # fmt: skip
    parser.add_argument("--plots", type=Path, metavar="DIR", help="write pictures")
    parser.add_argument(
        "--save-model",
        type=Path,
        action=StoreOnce,
        metavar="FILE",
        help="write the model as .toml or .mat, .control.py for python-control; with --aircraft as"
        " .xml for JSBSim, -set.xml for FlightGear, .sdf for Gazebo, .h for ArduPilot's SITL, .st"
        " as AVL's table, .aerosandbox.py",
    )
    parser.add_argument(
        "--save-aircraft",
        type=Path,
        action=StoreOnce,
        metavar="FILE",
        help="write the aircraft for `host simulate`, with --aircraft",
    )


def run(args: argparse.Namespace) -> int:
    """Identify and print the answer; messages name options where the library names arguments."""
    # The matrices are small: threads of BLAS only wait for each other (28 s against 5 measured).
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from host.errors import UsageError
    from host.sysid.pipeline.arguments import option_words

    try:
        return _run(args)
    except UsageError as error:
        raise UsageError(option_words(str(error))) from error


def _run(args: argparse.Namespace) -> int:
    """Identify and print the answer: words first, then numbers."""
    from host.aircraft.origin import announce_aircraft
    from host.errors import ExitCode
    from host.readers.autopilot_flight import log_choices
    from host.sysid.answer import check_outputs
    from host.sysid.estimators import read_options
    from host.sysid.flight import chosen_flights
    from host.sysid.pipeline import identify
    from host.sysid.pipeline.arguments import option_words
    from host.sysid.pipeline.requested_models import requested_methods

    if lines := _asked_for(args):
        print("\n".join(lines))
        return int(ExitCode.OK)
    args.source = args.source or [source_or_newest(None)]
    files = len(args.source)
    mapping = of_each("--map", args.map, files)
    flights = chosen_flights(args.source, args.flight, mapping)
    args.source = flattened(flights)
    places = _places(args)
    check_outputs(places, requested_methods(args.method))
    found = identify(
        args.source,
        aircraft=args.aircraft,
        models=args.model,
        methods=args.method,
        calibration=of_each_flight(of_each("--calibration", args.calibration, files), flights),
        mapping=of_each_flight(mapping, flights),
        maneuvers=args.maneuver or (),
        stretches=of_each_flight(stretches_of_each(args.ends, files), flights),
        corrections=not args.no_corrections,
        accept=args.accept or (),
        sensors=log_choices(args.sensor, args.outputs),
        row_rate_hz=args.row_rate,
        delays=not args.no_delays,
        truth=[path for _, path in args.truth],
        prior=args.prior,
        method_options=read_options(args.method_option or ()),
    )
    announce_aircraft([args.aircraft])
    if args.json:
        text = option_words(found.to_json())
        # Files are written before the answer is printed, so that no answer follows an error.
        _say(found.save(places))
        print(text)
        return int(ExitCode.OK)
    text = option_words(found.to_text(shutil.get_terminal_size().columns, full=args.full))
    try:
        written = found.save(places)
    finally:
        print(text)  # the answer is not lost with its file
    _say(written)
    return int(ExitCode.OK)


def _asked_for(args: argparse.Namespace) -> list[str]:
    """Return what 'list' in place of a name shows; nothing where no list is asked for."""
    from host.readers.shipped_maps import LIST, map_lines
    from host.sysid.checks import check_lines
    from host.sysid.pipeline.requested_models import method_lines, model_lines

    if LIST in (args.method or ()):
        return method_lines()
    if LIST in (args.model or ()):
        return model_lines()
    if LIST in [str(path) for _, path in args.map]:
        return map_lines()
    return check_lines() if LIST in (args.accept or ()) else []


def _places(args: argparse.Namespace) -> OutputPaths:
    """Return where files go, and every file that the answer is made from."""
    from host.sysid.answer import OutputPaths

    placed = [*args.map, *args.calibration, *args.truth]
    given = [*args.source, *(path for _, path in placed), args.prior]
    given += [Path(name) for name in (args.aircraft, *(args.model or ())) if name]
    return OutputPaths(
        plots=args.plots,
        mat=args.mat,
        save_model=args.save_model,
        save_aircraft=args.save_aircraft,
        source=args.aircraft,
        history=args.history,
        given=tuple(path for path in given if path is not None),
    )


def _say(written: list[Path]) -> None:
    """Print the files that were written, pictures by their number."""
    pictures = [path for path in written if path.suffix == ".svg"]
    parts = [str(path) for path in written if path not in pictures]
    if pictures:
        parts.append(f"{len(pictures)} picture{'s' * (len(pictures) > 1)} in {pictures[0].parent}")
    if parts:
        print(f"wrote {', '.join(parts)}", file=sys.stderr)
