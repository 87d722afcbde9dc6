"""`host predict`: a saved model against another record."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from host.decode.newest_flight import source_or_newest
from host.placed_arguments import (
    StorePlaced,
    flattened,
    of_each,
    of_each_flight,
    stretches_of_each,
)
from host.source_arguments import add_data_choices, add_flight


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "predict",
        help="run a saved model over another record",
        description="Run a model of `host identify --save-model` over records it has not seen:"
        " derivatives held, only biases and start states fitted. Says the error in free"
        " simulation, one step ahead, and over windows against that of kinematic persistence.",
    )
    parser.add_files("model of `host identify --save-model`, or yours; then records: log, CSV,"
                     " Parquet, MAT, without one the newest flight of the working folder. --from"
                     " and --to belong to the record before them")  # fmt: skip
    parser.add_argument("--aircraft", metavar="NAME", help="aircraft file: places of the sensors;"
                        " give it where the model was identified with it")  # fmt: skip
    parser.add_argument("--map", type=Path, metavar="TOML", action=StorePlaced, default=[],
                        help="foreign names, units and signs: a file, or the name of a shipped map"
                        " ('list' shows them)")  # fmt: skip
    parser.add_argument("--calibration", type=Path, metavar="TOML", action=StorePlaced, default=[],
                        help="calibration of a log")  # fmt: skip
    parser.add_argument("--from", dest="ends", type=float, metavar="S", action=StorePlaced,
                        const=0, default=[], help="start of a stretch")  # fmt: skip
    parser.add_argument("--to", dest="ends", type=float, metavar="S", action=StorePlaced,
                        const=1, default=[], help="end of it")  # fmt: skip
    add_data_choices(parser)
    add_flight(parser, every=True)
    parser.add_argument("--no-constants", action="store_true",
                        help="fit nothing: start from the trim before each input")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--plots", type=Path, metavar="DIR",
                        help="write pictures of outputs and inputs")  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Predict and print; messages name options where the library names arguments."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from host.aircraft.origin import announce_aircraft
    from host.errors import ExitCode, IdentificationError, UsageError
    from host.readers.autopilot_flight import log_choices
    from host.readers.shipped_maps import LIST, map_lines
    from host.sysid.answer import OutputPaths, check_outputs
    from host.sysid.checks import check_lines
    from host.sysid.flight import chosen_flights
    from host.sysid.models.named_models import shipped_lines
    from host.sysid.pipeline import predict
    from host.sysid.pipeline.arguments import option_words

    if [str(name) for name in args.source] == [LIST] and not Path(LIST).exists():
        print("\n".join(shipped_lines()))
        return int(ExitCode.OK)
    if LIST in [str(one[-1]) for one in args.map]:
        print("\n".join(map_lines()))
        return int(ExitCode.OK)
    if LIST in (args.accept or ()):
        print("\n".join(check_lines()))
        return int(ExitCode.OK)
    try:
        if not args.source:
            raise IdentificationError("name a saved model, and behind it the records it predicts")
        model, *records = args.source
        records = records or [source_or_newest(None)]
        files = len(records)
        mapping = of_each("--map", _behind(args.map), files)
        flights = chosen_flights(records, args.flight, mapping)
        calibration = of_each("--calibration", _behind(args.calibration), files)
        stretches = stretches_of_each(_behind(args.ends), files)
        check_outputs(OutputPaths(plots=args.plots))
        found = predict(
            model,
            flattened(flights),
            aircraft=args.aircraft,
            calibration=of_each_flight(calibration, flights),
            mapping=of_each_flight(mapping, flights),
            maneuvers=args.maneuver or (),
            stretches=of_each_flight(stretches, flights),
            corrections=not args.no_corrections,
            accept=args.accept or (),
            sensors=log_choices(args.sensor, args.outputs),
            row_rate_hz=args.row_rate,
            constants=not args.no_constants,
        )
        announce_aircraft([args.aircraft])
        print(option_words(found.to_json() if args.json else found.to_text()))
        if args.plots is not None:
            written = found.plot().save(args.plots)
            print(
                f"wrote {len(written)} picture{'s' * (len(written) > 1)} in {args.plots}",
                file=sys.stderr,
            )
    except UsageError as error:
        raise UsageError(option_words(str(error))) from error
    return int(ExitCode.OK)


def _behind(placed: list[tuple[Any, ...]]) -> list[Any]:
    """Return arguments by the records before them: the model is the first file."""
    return [(max(place - 1, 0), *rest) for place, *rest in placed]
