"""The linear answer of `host identify` on virtual flights: errors, intervals, what it names.

Flights through the recorder, every tolerance drawn, light turbulence; answers as the verb gives
them, in coefficients and in the derivatives it prints first. A derivative's truth is made of the
local coefficients, the mass and inertia that were flown and the mean condition of the maneuvers.
Seeds 900-923 of `survey` were looked at while carrying was written, 2000-2023 before the rotor's
spin was in it; the study starts behind them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.errors import IdentificationError
from host.readers.even_grid import even_columns
from host.sysid.answer import true_coefficients
from host.sysid.linear import AXIS_OF, DEFAULT_METHOD
from host.sysid.pipeline import at_hand, identify_columns
from host.twin.virtual import VirtualFlight, virtual_flight

from studies.flights import Tally

FIRST_SEED = 3000
AIRCRAFT = "ultrastick25e"
SMALL = 1e-9
AXES = ("longitudinal", "lateral")


def study(card: str, seeds: range, method: str = DEFAULT_METHOD) -> tuple[Tally, Tally]:
    """Fly, fit and compare.

    Parameters
    ----------
    card : str
    seeds : range
    method : str

    Returns
    -------
    coefficients, derivatives : Tally
    """
    estimated, printed = Tally(), Tally()
    for seed in seeds:
        add(virtual_flight(card, seed), method, estimated, printed)
    return estimated, printed


def add(flight: VirtualFlight, method: str, estimated: Tally, printed: Tally) -> None:
    """Count one flight, its answers as `host identify` gives them."""
    columns, _ = even_columns(flight.table)
    maneuvers = list(flight.maneuvers)
    try:
        answers = identify_columns(
            at_hand(columns, aircraft=AIRCRAFT), models=AXES, methods=method
        ).linear
    except IdentificationError:
        estimated.failed += 1
        return
    frame = flight.record.frame
    flown = (frame.mass_kg, frame.ixx_kgm2, frame.iyy_kgm2, frame.izz_kgm2, frame.ixz_kgm2)
    for answer in answers:
        local = true_coefficients({"maneuver": maneuvers}, answer.template)
        doubted = {r.name for r in answer.identifiability_flags}
        for c in answer.coefficients:
            truth, flagged = local[c.name], not c.differs_from_zero
            estimated.add(
                c.name, truth, c.value, c.half_width, flagged=flagged, size=_size(c.name, local)
            )
        half = answer.result.half_width()
        expected = derivatives(local, maneuvers, answer.template, airframe_data(AIRCRAFT), flown)
        for name, truth in expected.items():
            if name in answer.result.names:
                k = answer.result.index(name)
                value, flagged = float(answer.result.estimate[k]), name in doubted
                size = _size(name, expected)
                printed.add(name, truth, value, float(half[k]), flagged=flagged, size=size)


def _size(name: str, local: Mapping[str, float]) -> float:
    """Return the reference of a relative error: the rudder's value, where the truth is zero."""
    return abs(local[name]) if abs(local[name]) > SMALL else abs(local[f"{name.split('_')[0]}_dr"])


def derivatives(
    local: Mapping[str, float],
    maneuvers: Sequence[Mapping[str, Any]],
    axis: str,
    sizes: AirframeData,
    flown: tuple[float, float, float, float, float],
) -> dict[str, float]:
    """Return the dimensional derivatives of a template that local coefficients stand for.

    Parameters
    ----------
    local : mapping
        Coefficients, moments about the CG.
    maneuvers : sequence of mapping
        Maneuvers of the truth file.
    axis : str
        ``longitudinal`` or ``lateral``.
    sizes : AirframeData
        Wing area, span and chord.
    flown : tuple of float
        Mass (kg), Ixx, Iyy, Izz and Ixz (kg m2) as they really were.
    """
    mine = {a.split("_")[0] for a in AXIS_OF[axis]}
    at = [m["condition"] for m in maneuvers if mine & set(m["axes"])]
    V, qbar = (float(np.mean([c[k] for c in at])) for k in ("airspeed_mps", "qbar_pa"))
    mass, ixx, iyy, izz, ixz = flown
    force = qbar * sizes.wing_area_m2
    b, c = sizes.span_m, sizes.chord_m
    found = {}
    if axis == "longitudinal":
        for label, by in (("alpha", 1.0), ("q", 0.5 * c / V), ("de", 1.0)):
            found[f"Z_{label}"] = -force * local[f"CL_{label}"] * by / (mass * V)
            found[f"M_{label}"] = force * c * local[f"Cm_{label}"] * by / iyy
            if label != "q":
                found[f"D_{label}"] = -force * local[f"CD_{label}"] / mass
        return found
    det = ixx * izz - ixz**2
    for label in ("beta", "p", "r", "da", "dr"):
        by = 0.5 * b / V if label in ("p", "r") else 1.0
        roll, yaw = (force * b * local[f"{k}_{label}"] * by for k in ("Cl", "Cn"))
        found[f"Y_{label}"] = force * local[f"CY_{label}"] * by / (mass * V)
        found[f"L_{label}"] = (izz * roll + ixz * yaw) / det
        found[f"N_{label}"] = (ixz * roll + ixx * yaw) / det
    return found


def main(arguments: list[str] | None = None) -> int:
    """Fly, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=24)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--card", default="survey")
    parser.add_argument("--method", default=DEFAULT_METHOD)
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.flights)
    estimated, printed = study(options.card, seeds, options.method)
    lines = [
        f"{options.card}: seeds {seeds.start} to {seeds.stop - 1}, {estimated.failed} fits failed",
        "coefficients",
        *estimated.lines(),
        "derivatives",
        *printed.lines(),
    ]
    sys.stdout.write("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
