"""Aircraft of either kind by name or file: coefficients or published matrices."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from host.aircraft import file as aircraft
from host.aircraft.aircraft_ranges import RANGES
from host.aircraft.airframe import Array
from host.aircraft.file import Aircraft, AircraftError, read_document
from host.aircraft.linear_dynamics import LinearDynamics
from host.constants import GRAVITY_MPS2
from host.files.quantities import Quantity

# Largest relative error of a file's gravity terms against g and the file's own angle of attack.
GRAVITY_TOLERANCE = 0.01
_CONDITION = {
    "u_mps": RANGES["trim.airspeed_mps"],
    "w_mps": Quantity("m/s", -1000.0, 1000.0, "as the airspeed"),
    "elevator_rad": Quantity("rad", -1.6, 1.6, "a surface hinged at most square to the flow"),
    "throttle": Quantity("", 0.0, 1.0, "a share"),
}
LARGEST_ENTRY = 1e5  # M_q of an indoor model -100, Z_de of a fighter 200


def load(source: str | Path) -> Aircraft:
    """Load an aircraft of any kind.

    A linear one names in `base` the aircraft that gives all that is not in its matrices: sensors
    and their places, servos, limits, geometry, mass.

    Parameters
    ----------
    source : str or Path
        Name of a packaged aircraft, or path of a file.

    Returns
    -------
    Aircraft

    Raises
    ------
    AircraftError
        A number is missing or wrong; matrices have the wrong size.
    """
    document = read_document(source)
    if document.get("kind") != "linear":
        return aircraft.load(source)
    if not isinstance(document.get("source"), str):
        raise AircraftError(f"{source}: the matrices have no source")
    base = aircraft.load(str(document.get("base", "")))
    numbers = {
        key: quantity.check(f"{source}: {key}", document.get(key), AircraftError)
        for key, quantity in _CONDITION.items()
    }
    shapes = {"longitudinal_a": (4, 4), "longitudinal_b": (4, 1), "lateral_a": (4, 4),
              "lateral_b": (4, 2)}  # fmt: skip
    matrices = {name: _matrix(source, document, name, shape) for name, shape in shapes.items()}
    alpha = math.atan2(numbers["w_mps"], numbers["u_mps"])
    gravity_terms = matrices["longitudinal_a"][0, 3], matrices["lateral_a"][0, 3]
    for found, sign in zip(gravity_terms, (-1.0, 1.0), strict=True):
        expected = sign * GRAVITY_MPS2 * math.cos(alpha)
        if abs(found - expected) > GRAVITY_TOLERANCE * GRAVITY_MPS2:
            raise AircraftError(
                f"{source}: gravity enters with {found:.4g} m/s2, expected {expected:.4g}"
            )
    # Such matrices have no motor: the throttle is recorded and moves nothing.
    wide = np.hstack([matrices["longitudinal_b"], np.zeros((4, 1))])
    straight = LinearDynamics(
        **numbers,
        longitudinal_a=matrices["longitudinal_a"],
        longitudinal_b=wide,
        lateral_a=matrices["lateral_a"],
        lateral_b=matrices["lateral_b"],
    )
    return with_linear_dynamics(
        base,
        straight,
        name=str(document.get("name", Path(source).stem)),
        title=str(document.get("title", source)),
    )


def with_linear_dynamics(
    base: Aircraft, straight: LinearDynamics, *, name: str, title: str
) -> Aircraft:
    """Return `base` with the linear dynamics in place of its aerodynamics and propulsion."""
    speed = math.hypot(straight.u_mps, straight.w_mps)
    return replace(
        base,
        name=name,
        title=title,
        scalars={**base.scalars, "trim.airspeed_mps": speed},
        straight=straight,
    )


def _matrix(
    source: str | Path, document: dict[str, object], name: str, shape: tuple[int, int]
) -> Array:
    try:
        matrix = np.array(document.get(name), dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != shape:
        raise AircraftError(f"{source}: {name} has shape {matrix.shape}, expected {shape}")
    if not np.all(np.abs(matrix) <= LARGEST_ENTRY):
        raise AircraftError(
            f"{source}: {name} has an entry of {np.max(np.abs(matrix)):g}, expected up to"
            f" {LARGEST_ENTRY:g}"
        )
    return matrix
