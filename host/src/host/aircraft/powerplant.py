"""Thrust and spin of a propeller from the throttle, by the fits in the aircraft file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from host.aircraft.airframe import Airframe
from host.aircraft.file import AircraftError, load_measured
from host.aircraft.propulsion import (
    RotorInputs,
    motor_torque,
    propeller,
    rotor_history,
    thrust_of_power,
)
from host.arrays import Array

Step = Callable[[float, float, float, float], tuple[float, float, float]]
OfPower = Callable[[Array, Array, Array], Array]
History = Callable[[RotorInputs, float, float, int], Array]
SUBSTEPS = 3  # Euler steps per 33 Hz sample: a rotor's time constant is 0.1 s or more
START_RADPS = 600.0  # a guess whose effect is gone within half a second
SETTLED, SETTLING_S = 200, 0.03  # samples until a rotor keeps its speed, and their distance
STEP_MPS, STEP_SHARE = 0.5, 0.01  # of airspeed and density: central differences


@dataclass(frozen=True, slots=True)
class Powerplant:
    """Thrust, torque and rotor inertia of a propeller with its motor.

    Attributes
    ----------
    step : callable
        Takes rotor speed, throttle, airspeed and density; returns thrust (N), torque of the air
        and torque of the motor (N m).
    history : callable
        `propulsion.rotor_history` of this aircraft.
    rotor_kgm2 : float
    axis : (3,) Array
        Unit vector of thrust, body axes.
    hub_m : (3,) Array
        From the nominal CG.
    of_power : callable, optional
        Takes shaft power (W), airspeed and density of a flight; returns thrust (N), (n,). None
        where the aircraft file does not describe a propeller.
    """

    step: Step
    history: History
    rotor_kgm2: float
    axis: Array
    hub_m: Array
    of_power: OfPower | None = None

    @property
    def present(self) -> bool:
        """Whether the aircraft file describes a propeller; else thrust is measured or none."""
        return self.of_power is not None

    def run(
        self, throttle: Array, airspeed_mps: Array, density_kgpm3: Array, dt_s: float
    ) -> tuple[Array, Array, Array]:
        """Return thrust (N), rotor speed (rad/s) and motor torque (N m), each (n,)."""
        inputs = RotorInputs(
            np.ascontiguousarray(throttle),
            np.ascontiguousarray(airspeed_mps),
            np.ascontiguousarray(density_kgpm3),
        )
        thrust, spin, drive = self.history(inputs, START_RADPS, dt_s / SUBSTEPS, SUBSTEPS)
        return thrust, spin, drive

    def settled_slopes(
        self, throttle: float, airspeed_mps: float, density_kgpm3: float
    ) -> tuple[float, float]:
        """Return the slopes of thrust, rotor speed settled, by airspeed (N per m/s) and by
        relative density (N).
        """

        def thrust(faster: float, denser: float) -> float:
            around = np.full(SETTLED, airspeed_mps + faster)
            air = np.full(SETTLED, density_kgpm3 * (1.0 + denser))
            return float(self.run(np.full(SETTLED, throttle), around, air, SETTLING_S)[0][-1])

        by_speed = (thrust(STEP_MPS, 0.0) - thrust(-STEP_MPS, 0.0)) / (2.0 * STEP_MPS)
        by_density = (thrust(0.0, STEP_SHARE) - thrust(0.0, -STEP_SHARE)) / (2.0 * STEP_SHARE)
        return by_speed, by_density


class NoPropulsionError(AircraftError):
    """A measured aircraft without a section [propulsion]."""


def without_propeller() -> Powerplant:
    """Return an aircraft without a known propeller: no thrust, along x through the CG."""

    def nothing(*_: float) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.0

    def still(inputs: RotorInputs, *_: float) -> Array:
        return np.zeros((3, len(inputs[0])))

    return Powerplant(nothing, still, 0.0, np.array([1.0, 0.0, 0.0]), np.zeros(3))


def powerplant(source: str) -> Powerplant:
    """Return the propeller and motor of an aircraft by name or file.

    Raises
    ------
    NoPropulsionError
        If a measured aircraft does not describe them.
    """
    loaded = load_measured(source)
    if "propulsion.diameter_m" not in loaded.scalars:
        raise NoPropulsionError(
            f"aircraft {source}: no section [propulsion]; coefficients straight from"
            " flight need the thrust: add it, or leave 'coefficients' out of argument models"
        )
    frame = loaded.airframe()
    return Powerplant(
        partial(_step, frame),
        partial(rotor_history, frame),
        frame.rotor_inertia_kgm2,
        frame.thrust_axis,
        frame.hub_m - frame.cg_m,
        partial(thrust_of_power, frame),
    )


def _step(
    frame: Airframe,
    spin_radps: float,
    throttle: float,
    airspeed_mps: float,
    density_kgpm3: float,
) -> tuple[float, float, float]:
    thrust, load = propeller(frame, spin_radps, airspeed_mps, density_kgpm3)
    return thrust, load, motor_torque(frame, throttle, spin_radps)
