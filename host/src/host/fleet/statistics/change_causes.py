"""What a change of the aircraft does to its derivatives: one pattern for each likely cause.

Sizes are shares (of a throw, a mass, a vane's slope) and, of the CG, shares of the chord, aft
positive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array

CG, MASS = "place of the CG", "mass"
THROWS = {"de": "throw of the elevator", "da": "throw of the ailerons", "dr": "throw of the rudder"}
VANES = {"alpha": "slope of the alpha vane", "beta": "slope of the beta vane"}


def cause_patterns(
    names: Sequence[str], usual: Mapping[str, float], chord_over_span: float
) -> dict[str, Array]:
    """Return by how much a change of size 1 moves each derivative, (P,), by cause.

    Parameters
    ----------
    names : sequence of str
        Derivatives.
    usual : mapping
        Their values before the change.
    chord_over_span : float
    """
    value = {n: usual[n] for n in names}
    found: dict[str, dict[str, float]] = {CG: _aft_cg(value, chord_over_span)}
    # All forces and moments are mass and inertia times what was measured.
    found[MASS] = {n: -v for n, v in value.items() if n.startswith(("CL", "CD", "CY"))}
    for label, cause in (THROWS | VANES).items():
        sign = 1.0 if label in THROWS else -1.0
        found[cause] = {n: sign * v for n, v in value.items() if n.endswith(f"_{label}")}
    return {
        cause: np.array([moved.get(n, 0.0) for n in names])
        for cause, moved in found.items()
        if any(moved.values())
    }


def _aft_cg(value: Mapping[str, float], chord_over_span: float) -> dict[str, float]:
    """Return what a CG one chord further aft does: moments, and rates through alpha and beta."""
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
