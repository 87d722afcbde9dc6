"""Prior coefficients out of an aircraft file: from a handbook, a publication or other flights."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from host.aircraft.file import load, read_document
from host.aircraft.local_derivatives import ARGUMENTS, FORCES, local_derivatives
from host.aircraft.origin import aircraft_origin
from host.aircraft.prior.prior_table import Points, PriorTable

_EVERY_RAD = np.radians(2.0)


def has_coefficients(source: str | Path) -> bool:
    """Return whether an aircraft's file, or what the handbook makes of it, has coefficients.

    Raises
    ------
    AircraftError
        If it cannot be read.
    """
    return read_document(source).get("kind") == "nonlinear"


def aircraft_prior(source: str | Path) -> PriorTable:
    """Return an aircraft's derivatives over the angle of attack, all else at zero.

    Parameters
    ----------
    source : str or Path
        Name of a packaged aircraft, its file, or a file of its dimensions.

    Raises
    ------
    AircraftError
        If it cannot be read, or has no coefficients.
    """
    aircraft = load(source)
    frame = aircraft.airframe()
    nodes = aircraft.vector("aerodynamics.alpha_rad")
    points: Points = {}
    for alpha_rad in np.arange(nodes[0], nodes[-1] + 1e-9, _EVERY_RAD).tolist():
        local = local_derivatives(frame, np.array([alpha_rad, *[0.0] * (len(ARGUMENTS) - 1)]))
        for name in (f"{force}_{argument}" for force in FORCES for argument in ARGUMENTS):
            points.setdefault(name, []).append((alpha_rad, local[name]))
    return PriorTable(points, stability_axes=False, source=(aircraft_origin(source),))
