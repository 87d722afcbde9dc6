"""Thrust and spin of a propeller from the throttle, by the fits in the aircraft file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from host.compiled import Array

Step = Callable[[float, float, float, float], tuple[float, float, float]]
STRIDE, SUBSTEPS = 1, 3  # a rotor takes 0.1 s and more to answer; records come at 33 Hz
START_RADPS = 600.0  # forgotten within half a second


@dataclass(frozen=True, slots=True)
class Powerplant:
    """How the propeller answers; `step` maps rotor speed, throttle, airspeed and density.

    Attributes
    ----------
    step : callable
        Returns thrust (N), torque of the air and of the motor (N m).
    rotor_kgm2 : float
    axis : (3,) Array
        Unit vector of thrust, body axes.
    hub_m : (3,) Array
        From the nominal CG.
    """

    step: Step
    rotor_kgm2: float
    axis: Array
    hub_m: Array

    def run(
        self, throttle: Array, airspeed_mps: Array, density_kgpm3: Array, dt_s: float
    ) -> tuple[Array, Array, Array]:
        """Return thrust (N), rotor speed (rad/s) and motor torque (N m), each (n,)."""
        every = np.arange(0, len(throttle), STRIDE)
        result = np.empty((3, len(every)))
        speed, part = START_RADPS, STRIDE * dt_s / SUBSTEPS
        push = load = torque = 0.0
        for k, i in enumerate(every):
            for _ in range(SUBSTEPS):
                push, load, torque = self.step(
                    speed, float(throttle[i]), float(airspeed_mps[i]), float(density_kgpm3[i])
                )
                speed = max(speed + part * (torque - load) / self.rotor_kgm2, 0.0)
            result[:, k] = push, speed, torque
        at = np.arange(len(throttle))
        thrust, spin, drive = (np.interp(at, every, row) for row in result)
        return thrust, spin, drive

    def slope(self, spin_radps: float, airspeed_mps: float, density_kgpm3: float) -> float:
        """Return how thrust changes with airspeed (N per m/s) at constant rotor speed."""
        above, below = (
            self.step(spin_radps, 0.5, airspeed_mps + half, density_kgpm3)[0]
            for half in (0.5, -0.5)
        )
        return above - below
