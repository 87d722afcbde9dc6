"""`host fleet`: the model of a type from the flights of its fleet."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from host.errors import ExitCode, UsageError
from host.extras import install_hint

_DESCRIPTION = """\
Identify every flight of a fleet, each in a process of its own, and say what the type is: mean,
spread between aircraft, spread between flights, what has changed. It may be stopped at any time;
the same command does only what is new.
"""


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "fleet",
        help="the model of a type from the flights of its fleet",
        description=_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sources", nargs="*", metavar="SOURCE", help="log, folder, pattern or an"
                        " address that fsspec reads, such as s3://club/2026/**")  # fmt: skip
    parser.add_argument("--aircraft", metavar="FILE", help="aircraft file of flights without one"
                        " in the table")  # fmt: skip
    parser.add_argument("--table", type=Path, metavar="FLEET.csv", help="assigns sources or"
                        " serials to aircraft, type, file, calibration, map, date; without it a"
                        " log's folder names its aircraft")  # fmt: skip
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", required=True,
                        help="folder of the dataset and of the report")  # fmt: skip
    parser.add_argument("--model", action="append", metavar="FILE", help="kind 'coefficients', as"
                        " of `host identify`; without one the standard coefficients, or the linear"
                        " models of a flight without vanes")  # fmt: skip
    parser.add_argument("--accept", action="append", metavar="CHECK", help="as of `host identify`;"
                        " repeatable")  # fmt: skip
    parser.add_argument("--workers", type=int, default=0, metavar="N",
                        help="processes on this computer (default: one for each core)")  # fmt: skip
    parser.add_argument("--scheduler", default="", metavar="ADDRESS", help="another Dask"
                        " cluster, such as tls://lab:8786")  # fmt: skip
    parser.add_argument("--most-seconds", type=float, default=300.0, metavar="S",
                        help="most processor time for a flight (default 300; by the clock six times"
                        " as much)")  # fmt: skip
    parser.add_argument("--most-memory", type=float, default=3000.0, metavar="MB",
                        help="most memory for a flight (default 3000)")  # fmt: skip
    parser.add_argument("--retry", action="store_true", help="try flights again that were set"
                        " aside")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the type's model as JSON")


def run(args: argparse.Namespace) -> int:
    """Identify what is new, and print what the type is."""
    try:
        import bokeh  # noqa: F401  the dashboard
        import cryptography  # noqa: F401  the scheduler's keys
        import distributed  # noqa: F401
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise UsageError(f"host fleet needs {error.name}: {install_hint(error.name)}") from None
    if args.workers < 0:
        raise UsageError(f"--workers is {args.workers}, expected 1 or more")
    for name in ("most_seconds", "most_memory"):
        if not getattr(args, name) > 0.0:
            option = name.replace("_", "-")
            raise UsageError(f"--{option} is {getattr(args, name):g}, expected more than 0")
    return _run(args)


def _run(args: argparse.Namespace) -> int:
    from host.fleet.flight_task import DEFAULT_MODELS, TaskLimits
    from host.fleet.runs.fleet_answer import fleet_answer
    from host.fleet.runs.fleet_run import run_fleet
    from host.fleet.sources.fleet_table import read_table
    from host.fleet.sources.flight_keys import FleetSources
    from host.fleet.tasks.task_cluster import ClusterOptions
    from host.progress import draw_share

    sources = FleetSources(
        args.sources,
        args.aircraft or "",
        read_table(args.table) if args.table else (),
        tuple(args.model or DEFAULT_MODELS),
        tuple(args.accept or ()),
    )
    found = run_fleet(
        sources,
        args.output,
        limits=TaskLimits(args.most_seconds, args.most_memory, 6.0 * args.most_seconds),
        cluster=ClusterOptions(args.workers, args.scheduler),
        retry=args.retry,
        tell=lambda line: print(f"host: {line}", file=sys.stderr),
        progress=lambda done, of: draw_share("fleet", done / of),
    )
    assert found.rows is not None
    answer = fleet_answer(found.rows, args.output)
    counts = f"{found.done} identified, {found.set_aside} set aside now; {found.known} known before"
    print(f"host: {counts}", file=sys.stderr)
    print(json.dumps(answer.document()) if args.json else "\n".join(answer.lines()))
    print(f"wrote {', '.join(map(str, answer.written))}", file=sys.stderr)
    return int(ExitCode.OK)
