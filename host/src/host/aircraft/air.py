"""The air: standard atmosphere shifted to the field, steady wind, Dryden turbulence.

Turbulence: MIL-F-8785C, 3.7.2 (Dryden form) and 3.7.3 (low altitude), first- and second-order
filters driven by white noise; p_g and q_g, r_g of 3.7.5 with the span as the scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from host.aircraft.airframe import Array
from host.compiled import compiled_fast
from host.constants import GRAVITY_MPS2

GAS_CONSTANT = 287.05287  # J/(kg K), ICAO Doc 7488
LAPSE_KPM = 0.0065
EXPONENT = GRAVITY_MPS2 / (GAS_CONSTANT * LAPSE_KPM)
ZERO_CELSIUS_K = 273.15
GUST_STATES = 8


@dataclass(frozen=True, slots=True)
class Air:
    """Steady wind and Dryden turbulence (MIL-F-8785C 3.7.2, low-altitude form unless lengths are
    given)."""

    wind_north_mps: float = 0.0
    wind_east_mps: float = 0.0
    turbulence_mps: float = 0.0  # standard deviation of the vertical gust
    length_w_m: float = 0.0  # of gust w; 0: the height over the ground, as MIL-F-8785C
    length_u_m: float = 0.0  # of gusts u and v; 0: MIL-F-8785C for the height
    ratio_u: float = 0.0  # sigma_u / sigma_w; 0: MIL-F-8785C for the height


class Atmosphere(NamedTuple):
    """Pressure and temperature at the field; the lapse is the standard one."""

    pressure_pa: float
    temperature_k: float


class Turbulence(NamedTuple):
    """Dryden intensities (m/s) and scale lengths (m) that hold for one flight."""

    sigma_u_mps: float
    sigma_w_mps: float
    length_u_m: float
    length_w_m: float


def atmosphere(pressure_pa: float, temperature_degc: float) -> Atmosphere:
    """Return the atmosphere over a field with this pressure and temperature."""
    return Atmosphere(pressure_pa, temperature_degc + ZERO_CELSIUS_K)


@compiled_fast
def static_pressure_pa(air: Atmosphere, height_m: float) -> float:
    """Return static pressure at a height over the field."""
    share = 1.0 - LAPSE_KPM * height_m / air.temperature_k
    return air.pressure_pa * math.pow(share, EXPONENT)


@compiled_fast
def density_kgpm3(air: Atmosphere, height_m: float) -> float:
    """Return density at a height over the field, of dry air."""
    temperature = air.temperature_k - LAPSE_KPM * height_m
    return static_pressure_pa(air, height_m) / (GAS_CONSTANT * temperature)


def turbulence(air: Air, height_m: float) -> Turbulence:
    """Return Dryden intensities and scale lengths, from MIL-F-8785C where `air` has zeros.

    Parameters
    ----------
    air : Air
    height_m : float
        Height over the ground; the formulas hold from 3 to 300 m and are clamped there.
    """
    # MIL-F-8785C 3.7.3, low altitude, height in feet.
    feet = min(max(height_m, 3.0), 304.8) / 0.3048
    shape = 0.177 + 0.000823 * feet
    length_w = air.length_w_m or feet * 0.3048
    length_u = air.length_u_m or feet / shape**1.2 * 0.3048
    ratio = air.ratio_u or shape**-0.4
    return Turbulence(air.turbulence_mps * ratio, air.turbulence_mps, length_u, length_w)


@compiled_fast
def gust_step(
    t: Turbulence,
    z: Array,
    noise: Array,
    airspeed_mps: float,
    span_m: float,
    step_s: float,
    out: Array,
) -> None:
    """Advance the gust filters and write motion of the air u, v, w, p, q, r to `out` (6,).

    Parameters
    ----------
    t : Turbulence
    z : (8,) array
        Filter states, changed in place.
    noise : (4,) array
        Independent standard normal numbers.
    airspeed_mps, span_m, step_s : float
    out : (6,) array
        Along the path, to its right, down (m/s); about the body's axes (rad/s), for they are of its
        size. Where w grows towards the nose, the air turns nose-down.
    """
    # Dryden forms of MIL-F-8785C 3.7.2 (EQUATIONS.md, eq. 9): u of first order, v and w of second.
    v = max(airspeed_mps, 1.0)
    root = 1.0 / math.sqrt(step_s)
    tau_u, tau_w = t.length_u_m / v, t.length_w_m / v
    tau_b = 4.0 * span_m / (math.pi * v)
    z[0] += step_s * (-z[0] / tau_u + t.sigma_u_mps * math.sqrt(2.0 / tau_u) * noise[0] * root)
    # (1 + sqrt(3) tau s) / (1 + tau s)^2 as two lags in a row.
    z[1] += step_s * (noise[1] * root - z[1]) / tau_u
    z[2] += step_s * (z[1] - z[2]) / tau_u
    z[3] += step_s * (noise[2] * root - z[3]) / tau_w
    z[4] += step_s * (z[3] - z[4]) / tau_w
    three = math.sqrt(3.0)
    gust_v = t.sigma_u_mps * math.sqrt(tau_u) * (three * z[1] + (1.0 - three) * z[2])
    gust_w = t.sigma_w_mps * math.sqrt(tau_w) * (three * z[3] + (1.0 - three) * z[4])
    # p_g, q_g and r_g of MIL-F-8785C 3.7.5 (EQUATIONS.md, eq. 10), with the span as the scale.
    roll = (
        t.sigma_w_mps
        * math.sqrt(0.8 * math.pi / v)
        * (math.pi / (4.0 * span_m)) ** (1.0 / 6.0)
        / t.length_w_m ** (1.0 / 3.0)
    )
    z[5] += step_s * (roll * noise[3] * root - z[5]) / tau_b
    slope_w = (gust_w - z[6]) / tau_b
    slope_v = (gust_v - z[7]) / tau_b
    z[6] += step_s * slope_w
    z[7] += step_s * slope_v
    out[0], out[1], out[2] = z[0], gust_v, gust_w
    out[3], out[4], out[5] = z[5], -slope_w / v, slope_v / v


@compiled_fast
def gusts(t: Turbulence, noise: Array, airspeed_mps: float, span_m: float, step_s: float) -> Array:
    """Return a gust history (n, 6) at constant airspeed, from which a test takes statistics."""
    z = np.zeros(GUST_STATES)
    out = np.empty((noise.shape[0], 6))
    for i in range(noise.shape[0]):
        gust_step(t, z, noise[i], airspeed_mps, span_m, step_s, out[i])
    return out
