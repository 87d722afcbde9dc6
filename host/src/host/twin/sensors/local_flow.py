"""True air data of a flight: at the CG, and the local flow where a sensor sits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.aircraft.air import EXPONENT, LAPSE_KPM
from host.aircraft.airframe import DOWN, Q0, Q3, Array, P, R, U, W
from host.aircraft.attitude import to_body
from host.twin.flight.fly import FlightRecord
from host.twin.sensors.filters import cross


@dataclass(frozen=True, slots=True)
class AirData:
    """True air data on the grid of the flight, each (n,).

    Attributes
    ----------
    airspeed_mps, alpha_rad, beta_rad, qbar_pa, static_pa, density_kgpm3, temperature_k : arrays
        At the CG, gusts included (EQUATIONS.md, eq. 4).
    velocity_mps, rates_radps : (n, 3) arrays
        Motion against the air, body axes.
    """

    airspeed_mps: Array
    alpha_rad: Array
    beta_rad: Array
    qbar_pa: Array
    static_pa: Array
    density_kgpm3: Array
    temperature_k: Array
    velocity_mps: Array
    rates_radps: Array


def air_data(record: FlightRecord) -> AirData:
    """Compute the true air data of a flight."""
    states, air = record.states, record.air
    velocity = states[:, U : W + 1] - air[:, 3:6]
    if np.any(air[:, :3] != 0.0):
        velocity -= np.einsum("nij,nj->ni", to_body(states[:, Q0 : Q3 + 1]), air[:, :3])
    on_ground = record.thrust_n == 0.0
    on_ground &= record.t_s < record.card.flight.ground_s
    velocity[on_ground] = 0.0  # the pitot is covered and the vanes are held for the zero
    speed = np.linalg.norm(velocity, axis=1)
    height = -states[:, DOWN]
    warm = record.atmosphere.temperature_k
    static = record.atmosphere.pressure_pa * (1.0 - LAPSE_KPM * height / warm) ** EXPONENT
    return AirData(
        airspeed_mps=speed,
        alpha_rad=np.arctan2(velocity[:, 2], velocity[:, 0]),
        beta_rad=np.arcsin(velocity[:, 1] / np.maximum(speed, 1e-9)),
        qbar_pa=0.5 * record.density_kgpm3 * speed**2,
        static_pa=static,
        density_kgpm3=record.density_kgpm3,
        temperature_k=warm - LAPSE_KPM * height,
        velocity_mps=velocity,
        rates_radps=states[:, P : R + 1] - air[:, 6:9],
    )


def local_velocity(data: AirData, place_m: Array) -> Array:
    """Return the velocity against the air (n, 3) of a point `place_m` (3,) from the CG."""
    return data.velocity_mps + cross(data.rates_radps, place_m[None, :])
