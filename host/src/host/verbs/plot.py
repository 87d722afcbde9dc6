"""`host plot`: a flight as one page to look at, and as pictures for papers."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from host.decode.newest_flight import source_or_newest
from host.source_arguments import add_log_arguments, add_output

_DESCRIPTION = """\
Show a flight: one HTML page that needs no network, with strips in degrees, test points
shaded and graded, stick against servo, track, events and losses. SOURCE is whatever
`host decode` reads: a log, a folder or a mounted card (the newest flight is taken), a log
of PX4 or ArduPilot, original ASCII rows.
"""
_EPILOG = """\
exit codes: 0 ok, 2 usage, 3 shown with losses (as gaps), 4 not a log
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "plot",
        help="show a flight on a page, or as pictures for papers",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_log_arguments(parser)
    parser.add_argument("--map", type=Path, metavar="TOML",
                        help="of a table (CSV, Parquet, MAT): as of `host identify`")  # fmt: skip
    add_output(parser, "page to write; <name>.html in the working folder without it", "HTML", Path)
    parser.add_argument("--open", action="store_true", help="open the page in the browser")
    parser.add_argument(
        "--full",
        action="store_true",
        help="put every sample into the page, whatever its size; without it the"
        " page has those of test points and 5 s around, and an overview",
    )
    parser.add_argument("--png", type=Path, metavar="FILE", help="write strips as a picture")
    parser.add_argument("--svg", type=Path, metavar="FILE", help="write strips as a drawing")
    parser.add_argument(
        "--channels",
        metavar="NAMES",
        default="",
        help="strips of the picture, such as alpha_deg,q_degps+p_degps",
    )
    parser.add_argument(
        "--from", dest="from_s", type=float, metavar="S", help="start of the picture"
    )
    parser.add_argument(
        "--bode",
        action="store_true",
        help="identify, and show frequency responses with coherence, the models over them, in"
        " place of strips",
    )
    parser.add_argument("--aircraft", metavar="NAME", help="with --bode: as of `host identify`")
    parser.add_argument(
        "--model",
        action="append",
        default=[],
        metavar="NAME",
        help="with --bode: as of `host identify`; repeatable",
    )
    parser.add_argument("--to", dest="to_s", type=float, metavar="S", help="end of the picture")


def flight_request(args: argparse.Namespace, mapping: Path | None = None) -> Any:
    """Return what `add_log_arguments` was given as `host.report.flight_reading.FlightRequest`."""
    from host.readers.autopilot_flight import log_choices
    from host.report.flight_reading import FlightRequest

    return FlightRequest(
        source=source_or_newest(args.source),
        session=args.session,
        file_id=args.file_id,
        calibration=args.calibration,
        row_rate_hz=args.row_rate,
        mapping=mapping,
        sensors=tuple(log_choices(args.sensor, args.outputs).items()),
    )


def run(args: argparse.Namespace) -> int:
    """Write the page, say where; return the exit code."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from host.text import shown

    done = _bode(args) if args.bode else _plot(args)
    print("\n".join(map(shown, done.lines)))
    pages = [path for path in done.files if path.suffix.lower() in (".html", ".htm")]
    if args.open and pages:
        import webbrowser

        if not webbrowser.open(pages[-1].resolve().as_uri()):
            print(f"no browser answered: open {pages[-1]} yourself", file=sys.stderr)
    return int(done.exit_code)


def _pictures(args: argparse.Namespace) -> tuple[Path, ...]:
    return tuple(path for path in (args.png, args.svg) if path is not None)


def _plot(args: argparse.Namespace) -> Any:
    from host.errors import UsageError
    from host.report.plotting import PlotRequest, plot

    if args.aircraft or args.model:
        raise UsageError("--aircraft and --model: only --bode fits a model")
    strips = tuple(one for one in args.channels.split(",") if one)
    span = (args.from_s, args.to_s)
    return plot(
        PlotRequest(
            flight_request(args, args.map), args.output, args.full, _pictures(args), strips, span
        )
    )


def _bode(args: argparse.Namespace) -> Any:
    from host.errors import UsageError
    from host.report.frequency_plotting import FrequencyRequest, plot_frequency
    from host.sysid.pipeline.arguments import option_words

    wanted = flight_request(args, args.map)
    models = tuple(args.model)
    try:
        return plot_frequency(
            FrequencyRequest(wanted, args.output, _pictures(args), args.aircraft, models)
        )
    except UsageError as error:
        raise UsageError(option_words(str(error))) from error
