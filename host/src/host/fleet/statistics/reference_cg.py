"""Coefficients of a flight about another centre of gravity: moments and rate derivatives.

At a point x ahead of the CG the angle of attack is smaller by q x / V, so rate derivatives change
with the reference point as moments do. Etkin & Reid, Dynamics of Flight, 3rd ed., ch. 5; the
force's part is that of `derivative_conversion`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.fleet.statistics.loaded_flight import LoadedFlight

Place = tuple[float, float, float]


def about_cg(flight: LoadedFlight, shift_m: Place) -> LoadedFlight:
    """Return a flight's estimates about a point that lies `shift_m` from its CG.

    Parameters
    ----------
    flight : LoadedFlight
        Its `conditions` have chord_m, span_m, alpha_rad, lift and drag.
    shift_m : tuple of float
        x forward, y right, z down, from the CG of the flight.
    """
    if not any(shift_m):
        return flight
    count = len(flight.names)
    constant = _moved(flight, np.zeros(count), shift_m)
    gain = np.stack([_moved(flight, row, shift_m) - constant for row in np.eye(count)], axis=1)
    # Derivatives whose forces are unknown cannot be moved and are left out.
    lost = {n for n in flight.names if _needs(n) - set(flight.names)}
    return replace(
        flight,
        values=gain @ flight.values + constant,
        own=gain @ flight.own @ gain.T,
        loadings=flight.loadings @ gain.T,
        left_out=flight.left_out | lost,
    )


def _moved(flight: LoadedFlight, values: Array, shift_m: Place) -> Array:
    at, table = flight.conditions, dict(zip(flight.names, values.tolist(), strict=True))
    chord_m, span_m = at["chord_m"], at["span_m"]
    sine, cosine = float(np.sin(at["alpha_rad"])), float(np.cos(at["alpha_rad"]))
    # alpha at the CG is that at the point and 2 x/c of a rate there; beta 2 x/b less.
    for row in ("CL", "CD", "Cm"):
        if f"{row}_q" in table:
            table[f"{row}_q"] += 2.0 * shift_m[0] / chord_m * table.get(f"{row}_alpha", 0.0)
    for row in ("CY", "Cl", "Cn"):
        if f"{row}_r" in table:
            table[f"{row}_r"] -= 2.0 * shift_m[0] / span_m * table.get(f"{row}_beta", 0.0)
    # M_point = M_cg + (r_cg - r_point) x F
    x, z = -shift_m[0], -shift_m[2]
    moved = dict(table)
    for name in table:
        row, _, label = name.partition("_")
        up, back, side = (table.get(f"{c}_{label}", 0.0) for c in ("CL", "CD", "CY"))
        if row == "Cm":
            if label == "alpha":  # the wind axes turn with alpha
                up, back = up + at["drag"], back - at["lift"]
            axial, normal = up * sine - back * cosine, -up * cosine - back * sine
            moved[name] += (z * axial - x * normal) / chord_m
        elif row == "Cl":
            moved[name] -= z * side / span_m
        elif row == "Cn":
            moved[name] += x * side / span_m
    return np.array([moved[name] for name in flight.names])


def _needs(name: str) -> set[str]:
    """Return the derivatives from which a derivative about another point is computed."""
    row, _, label = name.partition("_")
    force = {"Cm": "CL", "Cl": "CY", "Cn": "CY"}.get(row)
    needed = {f"{force}_{label}"} if force and label else set()
    if label == "q":
        needed.add(f"{row}_alpha")
    if label == "r":
        needed.add(f"{row}_beta")
    return needed
