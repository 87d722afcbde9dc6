"""Signs that no aircraft in the house's convention has: lift slope, roll damping, controls.

Surfaces are positive trailing edge down (elevator), left (rudder) and left down, right up
(aileron), so that Cm_de < 0, Cn_dr < 0, Cl_da > 0. A canard's elevator has the other sign: its map
turns it round. Cm_alpha may have either sign: an unstable aircraft flies too.
"""

from __future__ import annotations

from collections.abc import Mapping

# Derivative to its sign and what it is called.
POSSIBLE: dict[str, tuple[float, str]] = {
    "Z_alpha": (-1.0, "lift must grow with the angle of attack"),
    "L_p": (-1.0, "rolling must be damped"),
    "M_de": (-1.0, "elevator down must pitch the nose down"),
    "N_dr": (-1.0, "rudder left must yaw the nose left"),
    "L_da": (1.0, "aileron must roll to the side where it is up"),
    "CL_alpha": (1.0, "lift must grow with the angle of attack"),
    "Cl_p": (-1.0, "rolling must be damped"),
    "Cm_de": (-1.0, "elevator down must pitch the nose down"),
    "Cn_dr": (-1.0, "rudder left must yaw the nose left"),
    "Cl_da": (1.0, "aileron must roll to the side where it is up"),
}


def impossible_signs(values: Mapping[str, float]) -> dict[str, str]:
    """Return the estimates whose sign is impossible, and what it says."""
    return {
        name: f"its sign is impossible: {POSSIBLE[name][1]}"
        for name, value in values.items()
        if name in POSSIBLE and value * POSSIBLE[name][0] < 0.0
    }
