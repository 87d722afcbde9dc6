"""Coefficients of the worn aircraft, from its dimensional derivatives at a condition."""

from __future__ import annotations

import math

import numpy as np
from host.arrays import Array
from numpy.typing import NDArray

from studies.field_records.worn_aeroplane import DENSITY_KGPM3, Worn


def thrust_of(a: Worn, airspeed_mps: Array) -> NDArray[np.float64]:
    """Return the thrust along x, N: it falls with the airspeed."""
    share = 1.0 - airspeed_mps / a.pitch_speed
    return np.asarray(a.static_thrust * a.throttle * share, dtype=np.float64)


def coefficients_of(
    a: Worn, of: dict[str, float], speed_mps: float, alpha_rad: float
) -> dict[str, float]:
    """Return the coefficients that `true_derivatives` are made of.

    Parameters
    ----------
    a : Worn
    of : dict
        ``D_alpha`` ... ``N_dr`` at the condition.
    speed_mps, alpha_rad : float
    """
    force = 0.5 * DENSITY_KGPM3 * speed_mps**2 * a.area
    weight = a.mass * speed_mps / force  # of a force over airspeed
    thrust = float(thrust_of(a, np.array(speed_mps))) / force
    by = {
        "alpha": 1.0, "de": 1.0, "q": 0.5 * a.chord / speed_mps, "beta": 1.0, "da": 1.0, "dr": 1.0,
        "p": 0.5 * a.span / speed_mps, "r": 0.5 * a.span / speed_mps,
    }  # fmt: skip
    found = {}
    for k in ("alpha", "q", "de"):
        found[f"CL_{k}"] = -weight * of[f"Z_{k}"] / by[k]
        found[f"Cm_{k}"] = a.iyy * of[f"M_{k}"] / (force * a.chord * by[k])
        found[f"CD_{k}"] = -a.mass * of[f"D_{k}"] / (force * by[k])
    found["CL_alpha"] -= thrust * math.cos(alpha_rad)
    found["CD_alpha"] -= thrust * math.sin(alpha_rad)
    moment = force * a.span
    for k in ("beta", "p", "r", "da", "dr"):
        roll, yaw = of[f"L_{k}"], of[f"N_{k}"]
        found[f"CY_{k}"] = weight * of[f"Y_{k}"] / by[k]
        found[f"Cl_{k}"] = (a.ixx * roll - a.ixz * yaw) / (moment * by[k])
        found[f"Cn_{k}"] = (a.izz * yaw - a.ixz * roll) / (moment * by[k])
    return found
