"""Vane readings at zero normal and side force: the zeros of the vanes, up to a constant.

alpha less (C_N - CL_de de) / (CL_alpha + CD), beta less (C_Y - CY_dr dr) / CY_beta, mean over the
maneuvers. An error of the mass changes neither, since it scales force and slope alike.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from host.aircraft.file import Aircraft
from host.arrays import Array
from host.sysid.flight import ReconstructedFlight

_BLOCK_S = 1.0  # gusts and the pilot's corrections go together for about so long
_LEAST_BLOCKS = 3
_NEEDED = ("alpha_rad", "beta_rad", "ay_mps2", "az_mps2", "qbar_pa", "elevator_rad", "rudder_rad")


def vane_zeros(
    flight: ReconstructedFlight,
    derivatives: Mapping[str, tuple[float, float]],
    drag: float,
    aircraft: Aircraft,
) -> dict[str, tuple[float, float]]:
    """Return the zeros of alpha and beta, each with its standard deviation, rad.

    Parameters
    ----------
    flight : ReconstructedFlight
        Without vanes it has none.
    derivatives : mapping of str to (float, float)
        Value and own standard deviation.
    drag : float
        CD at the flight's condition.
    aircraft : Aircraft
        Gives mass and wing area.
    """
    columns = flight.recorded
    if flight.angles is not None or any(name not in columns for name in _NEEDED):
        return {}
    inside: NDArray[np.bool_] = np.zeros(len(columns["t_s"]), dtype=np.bool_)
    for one in flight.maneuvers:
        first, last = one.fit_window()
        inside |= (columns["t_s"] >= first) & (columns["t_s"] <= last)
    used = {name: columns[name][inside] for name in ("t_s", *_NEEDED)}
    force = aircraft.scalar("mass.mass_kg") / aircraft.scalar("geometry.wing_area_m2")
    found = {}
    for name, angle, sign, accel, slope, surface, effect, more in (
        ("alpha_zero_rad", "alpha_rad", -1.0, "az_mps2", "CL_alpha", "elevator_rad", "CL_de", drag),
        ("beta_zero_rad", "beta_rad", 1.0, "ay_mps2", "CY_beta", "rudder_rad", "CY_dr", 0.0),
    ):
        if slope not in derivatives or not len(used["t_s"]):
            continue
        value, sd = derivatives[slope]
        pushed = sign * force * used[accel] / used["qbar_pa"]
        pushed = pushed - derivatives.get(effect, (0.0, 0.0))[0] * used[surface]
        left = used[angle] - pushed / (value + more)
        means = _block_means(left, used["t_s"])
        if len(means) >= _LEAST_BLOCKS:
            by_slope = float(np.mean(pushed)) / (value + more) ** 2 * sd
            scatter = float(np.std(means, ddof=1)) / np.sqrt(len(means))
            found[name] = (float(np.mean(left)), float(np.hypot(scatter, by_slope)))
    return found


def _block_means(values: Array, t_s: Array) -> Array:
    blocks = np.floor((t_s - t_s[0]) / _BLOCK_S).astype(np.int64)
    _, at = np.unique(blocks, return_inverse=True)
    return np.bincount(at, values) / np.bincount(at)
