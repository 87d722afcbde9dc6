"""Which of a pilot's test inputs the finder finds in rows of 10 and 5 Hz, and what else.

Records of `hand_flown`: seven inputs in five minutes each, and handling alone for the false ones.
An input is found if both ends are within a second. Records are flown anew from their seeds.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from host.arrays import Array
from host.sysid.maneuvers import DetectedManeuver, detect_maneuvers

from studies.hand_flown import PLANES, FlownByHand, decimated, flown

RATES_HZ = (10.0, 5.0)
FIRST_SEED = 41000
INPUTS, WITH_INPUTS_S, HANDLING_S = 7, 300.0, 600.0
WITHIN_S = 1.0


@dataclass
class Score:
    """Score of one aircraft at one rate: inputs flown and found, false ones in hours of
    handling."""

    flown: int = 0
    found: int = 0
    others: int = 0  # in records with inputs, none of them
    false: int = 0
    handling_s: float = 0.0

    def line(self, name: str) -> str:
        """Return a line of the table."""
        share, hours = 100.0 * self.found / self.flown, self.handling_s / 3600.0
        return (
            f"{name:14s} {self.found:4d} of {self.flown:4d} found ({share:5.1f} %),"
            f" {self.others:3d} others; {self.false:3d} false in {hours:.1f} h without"
        )


def is_found(truth: FlownByHand, found: Sequence[DetectedManeuver]) -> bool:
    """Return whether one of the maneuvers is an input, both ends within a second."""
    return any(
        item.axis == truth.axis
        and abs(item.start_s - truth.start_s) <= WITHIN_S
        and abs(item.input_end_s - truth.end_s) <= WITHIN_S
        for item in found
    )


def add_record(score: Score, columns: dict[str, Array], truth: Sequence[FlownByHand]) -> None:
    """Count what the finder finds in a record."""
    found = detect_maneuvers(columns)
    if not truth:
        score.false += len(found)
        score.handling_s += float(columns["t_s"][-1] - columns["t_s"][0])
        return
    score.flown += len(truth)
    score.found += sum(is_found(one, found) for one in truth)
    score.others += sum(
        not any(
            item.axis == one.axis and item.start_s < one.end_s and item.input_end_s > one.start_s
            for one in truth
        )
        for item in found
    )


def scores(records: int, handling: int, first: int) -> dict[tuple[float, str], Score]:
    """Fly and count, by rate and aircraft; `records` and `handling` of each."""
    result = {(rate, plane): Score() for rate in RATES_HZ for plane in PLANES}
    for plane in PLANES:
        flights = [(INPUTS, WITH_INPUTS_S, first + k) for k in range(records)]
        flights += [(0, HANDLING_S, first + 500 + k) for k in range(handling)]
        for inputs, length_s, seed in flights:
            columns, truth = flown(plane, seed, inputs=inputs, length_s=length_s)
            for rate in RATES_HZ:
                add_record(result[rate, plane], decimated(columns, rate), truth)
    return result


def main(arguments: list[str] | None = None) -> int:
    """Print a line for each rate and aircraft."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=34, help="with inputs, of each aircraft")
    parser.add_argument("--handling", type=int, default=10, help="without, of each aircraft")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    options = parser.parse_args(arguments)
    for (rate, plane), score in scores(options.records, options.handling, options.first).items():
        sys.stdout.write(score.line(f"{rate:4.0f} Hz {plane}") + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
