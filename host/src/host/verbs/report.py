"""`host report`: what a flight says of the aircraft, written up in one page to mail and print."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from host.decode.newest_flight import source_or_newest
from host.placed_arguments import StorePlaced, flattened, of_each, of_each_flight
from host.source_arguments import add_flight, add_output, add_row_rate, add_sensor

_DESCRIPTION = """\
Identify the aircraft from one or several flights, as `host identify` does, and write the
answer up: verdict, health of the data, calibration, maneuvers, sensors, measured against
model, parameters with intervals, modes, what to fly again. One HTML file without network,
scripts or links; print it to PDF from the browser.
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "report",
        help="write the identification of a flight as one page to mail",
        description=_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_files(
        "log (also of PX4, ArduPilot), CSV, Parquet, MAT; several are fitted together;"
        " without one the newest flight of the working folder"
    )
    add_output(parser, "page to write (default: <name>.report.html in the working folder)",
               "HTML", Path)  # fmt: skip
    parser.add_argument(
        "--aircraft",
        metavar="NAME",
        help="name or file of the aircraft: gives coefficients and causes of their widths",
    )
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="TOML",
        action=StorePlaced,
        default=[],
        help="calibration of a log: once for all, or behind each",
    )
    parser.add_argument(
        "--map",
        type=Path,
        metavar="TOML",
        action=StorePlaced,
        default=[],
        help="foreign names, units and signs: once for all, or behind each",
    )
    parser.add_argument(
        "--preflight",
        type=Path,
        metavar="FILE",
        help="sheet of `host preflight`; the one next to the log (NAME.preflight.toml) without it",
    )
    _add_answer_arguments(parser)


def _add_answer_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--model", action="append", metavar="NAME", help="as of `host identify`; repeatable"
    )
    parser.add_argument(
        "--method",
        action="append",
        metavar="NAME",
        help="as of `host identify`; several stand side by side; equation error joins the default"
        " one without it",
    )
    parser.add_argument(
        "--prior",
        type=Path,
        metavar="FILE",
        help="coefficients to compare with: TOML, AVL, Datcom, an aircraft; those of --aircraft"
        " without it",
    )
    parser.add_argument(
        "--truth",
        type=Path,
        metavar="TOML",
        action=StorePlaced,
        default=[],
        help="truth of a simulated flight; of several flights one each",
    )
    parser.add_argument("--tune", metavar="NAME",
                        help="find gains too, as `host tune --for NAME` does")  # fmt: skip
    add_row_rate(parser)
    add_sensor(parser)
    add_flight(parser, every=True)
    parser.add_argument("--no-delays", action="store_true", help="estimate no delay of a sensor")
    parser.add_argument("--open", action="store_true", help="open the page in the browser")
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON too")


def run(args: argparse.Namespace) -> int:
    """Write the report, say where and the verdict; return the exit code."""
    # The matrices are small: threads of BLAS only wait for each other (28 s against 5 measured).
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from host.aircraft.origin import announce_aircraft
    from host.errors import ExitCode, UsageError
    from host.readers.autopilot_flight import log_choices
    from host.report.reporting import ReportRequest, write_report
    from host.sysid.flight import chosen_flights
    from host.sysid.pipeline.arguments import option_words
    from host.terminal import command_line
    from host.text import shown

    given_sources = args.source or [source_or_newest(None)]
    mapping = of_each("--map", args.map, len(given_sources))
    flights = chosen_flights(given_sources, args.flight, mapping)
    sources = flattened(flights)
    calibration = of_each_flight(
        of_each("--calibration", args.calibration, len(given_sources)), flights
    )
    given = [args.prior, *(path for _, path in (*args.map, *args.truth))]
    files = [path for path in given if path is not None]
    if args.aircraft and Path(args.aircraft).is_file():
        files.append(Path(args.aircraft))
    request = ReportRequest(
        sources=sources,
        calibrations=calibration if isinstance(calibration, list) else [calibration] * len(sources),
        options={
            "aircraft": args.aircraft,
            "calibration": calibration,
            "models": args.model,
            "methods": args.method,
            "mapping": of_each_flight(mapping, flights),
            "truth": [path for _, path in args.truth],
            "prior": args.prior,
            "row_rate_hz": args.row_rate,
            "sensors": log_choices(args.sensor, args.outputs),
            "delays": not args.no_delays,
        },
        command=command_line("host", *sys.argv[1:]),
        output=args.output,
        preflight=args.preflight,
        files=files,
        tune=args.tune,
    )
    try:
        target, found = write_report(request)
    except UsageError as error:
        raise UsageError(option_words(str(error))) from error
    announce_aircraft([args.aircraft])
    print(
        found.to_json() if args.json else option_words("\n".join(map(shown, found.summary_lines())))
    )
    size = target.stat().st_size / 1e6
    print(f"wrote {shown(str(target))} ({size:.2f} MB)", file=sys.stderr)
    if args.open:
        import webbrowser

        webbrowser.open(target.resolve().as_uri())
    return int(ExitCode.OK)
