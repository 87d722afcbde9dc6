"""Who knows less is never surer: half-widths with knowledge taken away, over those with all of it.

    python -m studies.judgement.knowledge_order --flights 20

The same flights, maneuvers and method; dimensional derivatives, what is missing infinitely wide.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as `host identify` does

import numpy as np
from host.arrays import Array
from host.compiled import prefer_machine_code
from host.errors import IdentificationError
from host.instrument.deviations import sensor_error_model
from host.physical.calibration import load_calibration
from host.physical.recording import SURFACES, Recording
from host.readers.even_grid import even_columns
from host.sysid.maneuvers import detect_maneuvers
from host.sysid.pipeline import AircraftData, FlightAtHand, aircraft_data, at_hand, identify_columns
from host.twin.virtual import virtual_flight

from studies.judgement.judged_rows import PRINCIPAL

CARD, AIRCRAFT = "demo", "ultrastick25e"
METHODS = {"longitudinal": "filter-error-gust", "lateral": "output-error-white"}
MEDIAN, TENTH = 0.97, 0.90  # least ratio of half-widths: in the median, at the tenth percentile
GPS, ATTITUDE = ("v_north", "v_east", "v_down"), ("phi", "theta", "psi")
COMMAND = "command of "  # begins the name of a surface's command
SETTLED_ROWS, STILL_US = 30, 1.0  # a servo is where its pulse tells it to be
Columns = Mapping[str, Array]


def without(
    *begins: str, aircraft: str | AircraftData | None = AIRCRAFT, pots: bool = True
) -> Callable[[Columns], FlightAtHand]:
    """Return a flight without columns that begin so; without pots surfaces are commands."""

    def flight(columns: Columns) -> FlightAtHand:
        kept = {n: c for n, c in columns.items() if not n.startswith((*begins, COMMAND))}
        if pots:
            return at_hand(kept, aircraft=aircraft)
        commands = {f"{n}_rad": columns[f"{COMMAND}{n}"] for n in SURFACES}
        return at_hand(kept | commands, aircraft=aircraft, recording=Recording(commanded=SURFACES))

    return flight


def uncalibrated() -> AircraftData:
    """Return an aircraft of whose instrument nobody measured anything."""
    out_of_the_box = sensor_error_model(AIRCRAFT, load_calibration(), defaults=True)
    return replace(aircraft_data(AIRCRAFT), instrument=out_of_the_box)


LESS: dict[str, Callable[[Columns], FlightAtHand]] = {
    "calibration": without(aircraft=uncalibrated()),
    "aircraft file": without(aircraft=None),
    "GPS": without(*GPS),
    "pots": without(pots=False),
    "attitude": without(*ATTITUDE),
    "beta vane": without("beta"),
    "aircraft file, GPS": without(*GPS, aircraft=None),
    "calibration, GPS, attitude": without(*GPS, *ATTITUDE, aircraft=uncalibrated()),
    "aircraft file, pots": without(aircraft=None, pots=False),
    "all of these": without("beta", *GPS, *ATTITUDE, aircraft=None, pots=False),
}


def half_widths(flight: FlightAtHand, columns: Columns) -> dict[str, float]:
    """Return the half-width of each principal derivative; nothing where none is estimated."""
    found: dict[str, float] = {}
    windows = tuple(detect_maneuvers(columns))  # by the pots, whatever the flight has
    for model, method in METHODS.items():
        try:
            answer = identify_columns(
                replace(flight, windows=windows), models=model, methods=method
            )
        except IdentificationError:
            continue
        for one in answer.linear:
            half = one.result.half_width()
            found |= {
                p.name: float(half[k])
                for k, p in enumerate(one.model.parameters)
                if p.name in PRINCIPAL and half[k] > 0.0
            }
    return found


def ratios(columns: Columns, less: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return for each way to know less the half-widths over those of a flight with a file."""
    whole = half_widths(without()(columns), columns)
    found = {}
    for name in less:
        own = half_widths(LESS[name](columns), columns)
        found[name] = {n: own.get(n, np.inf) / half for n, half in whole.items()}
    return found


def flown(seed: int) -> Columns:
    """Return the columns of a flight of the twin, every tolerance drawn, and surfaces' commands."""
    table = virtual_flight(CARD, seed).table
    columns, _notes = even_columns(table)
    for surface in SURFACES:
        pulse = np.interp(columns["t_s"], table["t_s"], table[f"servo_{surface}_us"])
        before = np.concatenate([np.full(SETTLED_ROWS, np.nan), pulse[:-SETTLED_ROWS]])
        settled = np.abs(pulse - before) < STILL_US
        line = np.polyfit(pulse[settled], columns[f"{surface}_rad"][settled], 1)
        columns[f"{COMMAND}{surface}"] = np.polyval(line, pulse)
    return columns


def main(arguments: Sequence[str] | None = None) -> int:
    """Print how half-widths change where less is known."""
    name = "python -m studies.judgement.knowledge_order"
    parser = argparse.ArgumentParser(prog=name, description=__doc__)
    parser.add_argument("--flights", type=int, default=20)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    asked = parser.parse_args(arguments)
    every: dict[str, dict[str, list[float]]] = {}
    for seed in range(asked.first, asked.first + asked.flights):
        for less, own in ratios(flown(seed), tuple(LESS)).items():
            for name, ratio in own.items():
                every.setdefault(less, {}).setdefault(name, []).append(ratio)
    print("| without | derivative | median | tenth percentile | |\n| --- | --- | --- | --- | --- |")
    for less, table in every.items():
        for name, values in table.items():
            middle, low = float(np.median(values)), float(np.percentile(values, 10, method="lower"))
            missed = "!" if middle < MEDIAN or low < TENTH else ""
            print(f"| {less} | {name} | {middle:.2f} | {low:.2f} | {missed} |")
    return 0


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
