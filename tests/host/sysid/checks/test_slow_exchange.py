"""Angle of attack against pitch rate in an exchange of height and speed, without forces.

A glider of other equations than the twin's: q follows the path, alpha hardly moves.
"""

from __future__ import annotations

import numpy as np
import pytest
from host.arrays import Array
from host.sysid.checks import consistent
from scipy.integrate import solve_ivp

DT_S = 0.025


def glided() -> dict[str, Array]:
    """Return 12 s with a few steps of the elevator, noise in every column."""
    t = np.arange(480) * DT_S
    elevator = -0.02 + np.interp(
        t,
        [0.98, 1.1, 1.58, 1.7, 1.98, 2.1, 2.4, 2.5, 5.0, 5.1, 5.8, 5.9, 8.0, 8.1, 8.5, 8.6, 9, 9.1],
        np.array([0, 1, 1, -1, -1, 1, -1, 0, 0, -1.3, -1.3, 0, 0, 1, 1, -1, -1, 0]) * 0.05,
    )

    def rates(now: float, x: Array) -> list[float]:
        speed, alpha, theta, q = x
        force = 0.5 * 1.225 * 0.45 * speed**2 / 2.0  # by mass
        lift = 0.25 + 5.2 * alpha
        moment = 0.02 - 0.7 * alpha - 11.0 * q * 0.11 / speed - 0.9 * np.interp(now, t, elevator)
        path = theta - alpha
        return [
            -force * (0.02 + 0.045 * lift**2) - 9.81 * np.sin(path),
            q - (force * lift - 9.81 * np.cos(path)) / speed,
            q,
            force * 2.0 * 0.22 / 0.09 * moment,
        ]

    start = [11.97, 0.054, -0.014, 0.0]
    motion = solve_ivp(rates, (0.0, t[-1]), start, t_eval=t, rtol=1e-8, max_step=DT_S)
    noise = np.random.default_rng(3).standard_normal((4, 480))
    y = motion.y + noise * np.array([[0.1], [0.003], [0.003], [0.006]])
    names = ("airspeed_mps", "alpha_rad", "theta_rad", "q_radps")
    return {"t_s": t, "elevator_rad": elevator, **dict(zip(names, y, strict=True))}


@pytest.mark.parametrize("without", [(), ("airspeed_mps",), ("airspeed_mps", "theta_rad")])
def test_a_right_angle_of_attack_is_not_turned_round(without: tuple[str, ...]) -> None:
    """What alpha and elevator alone left of q turned the other way (-1.45 to -0.37)."""
    record = {name: v for name, v in glided().items() if name not in without}
    assert consistent(record, DT_S) == []


def test_a_wrong_sign_is_found_where_the_airspeed_is_known() -> None:
    record = glided()
    record["alpha_rad"] = -record["alpha_rad"]
    found = consistent(record, DT_S)
    assert [f.check for f in found] == ["alpha-against-q"]
    assert found[0].wrong_unit
