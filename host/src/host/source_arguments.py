"""Arguments that say which flight is meant and how its source is read, alike in every verb."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from host.placed_arguments import READS

OUTPUT_OF_AUTOPILOT = re.compile(r"\d+=[-A-Za-z]*")


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the one SOURCE of a verb that decodes, and what chooses within it."""
    parser.set_defaults(**{READS: True})
    parser.add_argument(
        "source",
        type=Path,
        nargs="?",
        metavar="SOURCE",
        help="log, folder or mounted card; the newest flight of the working folder without it",
    )
    parser.add_argument("--flight", "--session", dest="session", type=int, metavar="N",
                        help="one flight of several in a log, as `host info` lists them; of our own"
                        " logs one recording session")  # fmt: skip
    parser.add_argument(
        "--file-id",
        type=hexadecimal,
        metavar="HEX",
        help="blocks of this file id: older data, a second log in the file",
    )
    parser.add_argument(
        "--calibration", type=Path, metavar="FILE", help="counts to SI; the default without it"
    )
    add_sensor(parser)
    add_row_rate(parser)


def add_flight(parser: argparse.ArgumentParser, *, every: bool = False) -> None:
    """Add the choice among the flights of a log; `every` where several are fitted jointly."""
    more = ", or 'all', fitted together" if every else ""
    parser.add_argument("--flight", "--session", type=flight_argument if every else int,
                        metavar="N", help="flight N of a log with several, as `host info` lists"
                        f" them{more}; that with the longest time in the air without")  # fmt: skip


def flight_argument(text: str) -> int | str:
    """Return the number of a flight, or ``all``; argparse names this function in its error."""
    return text if text == "all" else int(text)


def add_sensor(parser: argparse.ArgumentParser) -> None:
    """Add the choice among the sensors of an autopilot."""
    parser.add_argument(
        "--sensor",
        action="append",
        default=[],
        metavar="MESSAGE=N",
        help="of an autopilot's log, instance N of a message, such as IMU=1; repeatable",
    )


class StoreOutput(argparse.Action):
    """Append ``2=elevator`` to the outputs of an autopilot; anything else is the file to write."""

    def __call__(
        self, parser: Any, namespace: Any, values: Any, option_string: str | None = None
    ) -> None:
        """Store one value."""
        if OUTPUT_OF_AUTOPILOT.fullmatch(values):
            namespace.outputs = [*namespace.outputs, values]
        elif self.const is None:
            raise argparse.ArgumentError(self, f"{values}: expected N=SURFACE, as 2=elevator")
        else:
            setattr(namespace, self.dest, self.const(values))


def add_output(
    parser: argparse.ArgumentParser,
    about: str = "",
    metavar: str = "",
    kind: Callable[[str], Any] | None = None,
) -> None:
    """Add ``--output N=SURFACE``, and of a verb that writes a file what is to be written."""
    names = ("-o", "--output") if kind else ("--output",)
    both = f"{metavar}: {about}. N=SURFACE: " if about else ""
    parser.set_defaults(outputs=[])
    parser.add_argument(*names, action=StoreOutput, const=kind,
                        metavar=f"{metavar}|N=SURFACE" if kind else "N=SURFACE",
                        help=f"{both}of an autopilot's log, output N moves this surface, as"
                        " 2=elevator, 2=-elevator turned round; repeatable")  # fmt: skip


def add_row_rate(parser: argparse.ArgumentParser) -> None:
    """Add the rate of rows without time."""
    parser.add_argument(
        "--row-rate",
        type=float,
        metavar="HZ",
        help="rate of original ASCII rows, which carry no time; estimated from GPS without it",
    )


def add_data_choices(parser: argparse.ArgumentParser) -> None:
    """Add what of a flight's data a model is fitted to or run over."""
    parser.add_argument("--maneuver", type=int, action="append", metavar="N",
                        help="use only maneuver N of `host maneuvers`; repeatable")  # fmt: skip
    parser.add_argument("--no-corrections", action="store_true",
                        help="leave the sensor errors that were estimated in the data")  # fmt: skip
    parser.add_argument("--accept", action="append", metavar="CHECK",
                        help="use columns as they are whatever this check of the data finds ('list'"
                        " shows them); repeatable")  # fmt: skip
    add_row_rate(parser)
    add_sensor(parser)
    add_output(parser)


def hexadecimal(text: str) -> int:
    """Return the number behind hexadecimal digits; argparse names this function in its error."""
    return int(text, 16)
