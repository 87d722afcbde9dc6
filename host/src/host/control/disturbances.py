"""How fast the surface moves in gusts of 1 m/s and by the gyro's noise."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from host.aircraft.air import Air, turbulence
from host.arrays import Array
from host.control.plant import RATES

GUST_MPS = 1.0
HEIGHT_M = 100.0  # where gains are tried in flight: well above the ground, below 120 m


def gust_inputs(
    axis: str, a: Array, states: Sequence[str], airspeed_mps: float, span_m: float, w: Array
) -> list[tuple[Array, Array]]:
    """Return what gusts of 1 m/s put into the aircraft: input column and spectrum of each.

    A gust is motion of the air: it enters where the aircraft's own motion through the air does.
    Spectra are one-sided, Dryden (MIL-F-8785C 3.7.2, 3.7.5), per rad/s.

    Parameters
    ----------
    axis : str
    a : Array, shape (n, n)
        System matrix of the aircraft alone.
    states : sequence of str
    airspeed_mps, span_m : float
    w : Array, shape (F,)
        rad/s.
    """
    air = turbulence(Air(turbulence_mps=GUST_MPS), HEIGHT_M)
    rates = [k for k, name in enumerate(states) if name in ("p_radps", "q_radps", "r_radps")]
    found: list[tuple[Array, Array]] = []

    def column(name: str) -> Array:
        j = list(states).index(name)
        rows = [*rates, j] if name in ("alpha_rad", "beta_rad") else rates
        into = np.zeros((len(states), 1))
        into[rows, 0] = a[rows, j]
        return into

    for name, sigma, length in (
        ("alpha_rad", air.sigma_w_mps, air.length_w_m),
        ("beta_rad", air.sigma_u_mps, air.length_u_m),
    ):
        if name in states:
            x = (length * w / airspeed_mps) ** 2
            spectrum = sigma**2 * length / (math.pi * airspeed_mps) * (1 + 3 * x) / (1 + x) ** 2
            found.append((column(name), spectrum / airspeed_mps**2))
    if axis == "roll" and span_m > 0.0:
        scale = 0.8 * (math.pi * air.length_w_m / (4.0 * span_m)) ** (1.0 / 3.0)
        falls = 1.0 + (4.0 * span_m * w / (math.pi * airspeed_mps)) ** 2
        spectrum = air.sigma_w_mps**2 / (air.length_w_m * airspeed_mps) * scale / falls
        found.append((column(RATES["roll"]), spectrum))
    return found


def gyro_noise_radps(columns: Sequence[Array]) -> float:
    """Return the standard deviation of white noise in columns of a rate.

    Second differences of white noise have six times its variance, and motion that is slow against
    the samples none.

    Parameters
    ----------
    columns : sequence of Array
        Evenly sampled, rad/s.
    """
    parts = [np.diff(one[np.isfinite(one)], 2) for one in columns if len(one) > 2]
    joined = np.concatenate(parts) if parts else np.zeros(0)
    # The median of the size, which single steps of motion do not move.
    return float(np.median(np.abs(joined)) / 0.6745 / math.sqrt(6.0)) if len(joined) else 0.0
