"""Thrust along the path and normal to it: it turns with the aircraft, so it is in Z_alpha.

The force normal to the path grows with the angle of attack by lift and by thrust, which is as large
as drag: 1 % of the lift slope. Klein & Morelli, Aircraft System Identification, ch. 3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.aircraft.mass_properties import AirframeData, Condition
from host.aircraft.powerplant import Powerplant, without_propeller
from host.arrays import Array
from host.sysid.aerodynamics.measured_thrust import thrust_column
from host.sysid.models.templates import Trim

ROTOR_COLUMNS = ("throttle", "airspeed_mps", "density_kgpm3")
# Drag coefficient of models with wheels and their gliders, where no propeller tells the thrust.
USUAL_DRAG, USUAL_DRAG_SD = 0.05, 0.02


@dataclass(frozen=True, slots=True)
class PathThrust:
    """Thrust along the path and normal to it, downwards, and one deviation of the first, N."""

    along_n: float
    normal_n: float
    deviation_n: float = 0.0

    def in_derivatives(self, mass_kg: float, airspeed_mps: float) -> dict[str, float]:
        """Return what of the derivatives of a template is thrust that turns with the aircraft."""
        return {
            "Z_alpha": -self.along_n / (mass_kg * airspeed_mps),
            "D_alpha": self.normal_n / mass_kg,
        }


def path_thrust(
    cuts: Sequence[Mapping[str, Array]],
    powerplant: Powerplant | None,
    airframe: AirframeData,
    trim: Trim,
    condition: Condition,
) -> PathThrust:
    """Return the mean thrust of maneuvers: measured, by throttle, or what drag and path ask for.

    Parameters
    ----------
    cuts : sequence of mapping
        All columns of each maneuver.
    powerplant : Powerplant or None
        Powerplant of the aircraft file.
    airframe : AirframeData
    trim : Trim
    condition : Condition
    """
    sine, cosine = float(np.sin(trim.alpha_rad)), float(np.cos(trim.alpha_rad))
    plant = powerplant or without_propeller()
    thrust_n = _mean_thrust_n(cuts, plant)
    if thrust_n is None:
        force = condition.qbar_pa * airframe.wing_area_m2
        ax, az = (
            float(np.mean(np.concatenate([c[name] for c in cuts]))) if name in cuts[0] else 0.0
            for name in ("ax_mps2", "az_mps2")
        )
        gain_n = airframe.mass_kg * (ax * cosine + az * sine) if ax and az else 0.0
        return PathThrust(gain_n + USUAL_DRAG * force, 0.0, USUAL_DRAG_SD * force)
    x, z = float(plant.axis[0]), float(plant.axis[2])
    return PathThrust(thrust_n * (x * cosine + z * sine), thrust_n * (z * cosine - x * sine))


def rotor_means(
    powerplant: Powerplant | None, cuts: Sequence[Mapping[str, Array]]
) -> tuple[float, float] | None:
    """Return mean thrust (N) and rotor speed (rad/s) by throttle; None where nothing tells them."""
    if powerplant is None or not all(name in c for c in cuts for name in ROTOR_COLUMNS):
        return None
    means = []
    for c in cuts:
        dt_s = float(c["t_s"][1] - c["t_s"][0])
        throttle, airspeed_mps, density_kgpm3 = (c[name] for name in ROTOR_COLUMNS)
        thrust, spin, _ = powerplant.run(throttle, airspeed_mps, density_kgpm3, dt_s)
        settled = slice(len(spin) // 4, None)  # the first of it is settling
        means.append((float(np.mean(thrust[settled])), float(np.mean(spin[settled]))))
    thrust_n, spin_radps = np.mean(means, axis=0)
    return float(thrust_n), float(spin_radps)


def _mean_thrust_n(cuts: Sequence[Mapping[str, Array]], plant: Powerplant) -> float | None:
    found = [thrust_column(c, plant) for c in cuts]
    if not all(one.known for one in found):
        return None
    columns = [one.thrust_n for one in found if one.thrust_n is not None]
    if len(columns) == len(found):
        return float(np.mean(np.concatenate(columns)))
    means = rotor_means(plant, cuts)
    return None if means is None else means[0]
