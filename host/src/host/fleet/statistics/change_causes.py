"""How a change of the aircraft shifts its derivatives: one pattern for each likely cause.

Sizes are shares (of a throw, a mass, a vane's or a pot's slope), of the CG shares of the chord, aft
positive, of a vane's zero rad, of a servo's lag s.

A throw moves all derivatives of its surface where commands stand for positions. Where a pot
measures the surface no derivative moves, only the slope of command to position; a pot whose own
slope has changed moves both, against each other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array
from host.fleet.statistics.watched_quantities import LAG_S, SLOPE, SURFACES, ZEROS

CG, MASS = "place of the CG", "mass"
VANES = {"alpha": "slope of the alpha vane", "beta": "slope of the beta vane"}
THROW, POT, LAG, VANE_ZERO = "throw of the", "pot of the", "lag of the", "zero of the"
_WHOSE = {"elevator": "elevator", "aileron": "ailerons", "rudder": "rudder", "servo": "servos"}
RARE = frozenset(f"{POT} {whose}" for whose in _WHOSE.values())  # a linkage slips more often


def cause_patterns(
    names: Sequence[str], usual: Mapping[str, float], chord_over_span: float
) -> dict[str, Array]:
    """Return the shift of each quantity, (P,), for a change of size 1, by cause.

    Parameters
    ----------
    names : sequence of str
        Derivatives and watched quantities (`watched_quantities`).
    usual : mapping
        Their values before the change.
    chord_over_span : float
    """
    value = {n: usual[n] for n in names}
    found: dict[str, dict[str, float]] = {CG: _aft_cg(value, chord_over_span)}
    # All forces and moments are mass and inertia times what was measured.
    found[MASS] = {n: -v for n, v in value.items() if n.startswith(("CL", "CD", "CY"))}
    for label, cause in VANES.items():
        found[cause] = _of_input(value, label, -1.0)
    for surface, label in SURFACES.items():
        found |= _surface(value, surface, label)
    for name, vane in ZEROS.items():
        found[f"{VANE_ZERO} {vane} vane"] = {name: 1.0}
    for whose in _WHOSE:
        found[f"{LAG} {_WHOSE[whose]}"] = {f"{whose}{LAG_S}": 1.0}
    return {
        cause: np.array([moved.get(n, 0.0) for n in names])
        for cause, moved in found.items()
        if any(moved.get(n, 0.0) for n in names)
    }


def size_text(cause: str, size: float) -> str:
    """Return the size of a change in the unit that people use for it."""
    if cause.startswith(VANE_ZERO):
        return f"{math.degrees(size):+.2f} deg"
    if cause.startswith(LAG):
        return f"{1e3 * size:+.1f} ms"
    return f"{100.0 * size:+.1f} %" + (" of the chord" if cause == CG else "")


def _of_input(value: Mapping[str, float], label: str, sign: float) -> dict[str, float]:
    return {n: sign * v for n, v in value.items() if n.endswith(f"_{label}")}


def _surface(value: Mapping[str, float], surface: str, label: str) -> dict[str, dict[str, float]]:
    """Return the shifts by a changed throw, and by a changed pot where there is one."""
    slope, whose = f"{surface}{SLOPE}", _WHOSE[surface]
    if slope not in value:
        return {f"{THROW} {whose}": _of_input(value, label, 1.0)}
    moved = {slope: value[slope]}
    return {f"{THROW} {whose}": moved, f"{POT} {whose}": moved | _of_input(value, label, -1.0)}


def _aft_cg(value: Mapping[str, float], chord_over_span: float) -> dict[str, float]:
    """Return the shifts by a CG one chord further aft: of moments, and of rates through alpha
    and beta."""
    moved = {}
    for name in value:
        row, _, label = name.partition("_")
        if row == "Cm":
            moved[name] = value.get(f"CL_{label}", 0.0)
        elif row == "Cn":
            moved[name] = chord_over_span * value.get(f"CY_{label}", 0.0)
        if label == "q":
            moved[name] = moved.get(name, 0.0) - 2.0 * value.get(f"{row}_alpha", 0.0)
        if label == "r":
            moved[name] = moved.get(name, 0.0) + 2.0 * chord_over_span * value.get(
                f"{row}_beta", 0.0
            )
    return moved
