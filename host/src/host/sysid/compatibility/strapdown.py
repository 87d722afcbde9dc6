"""Attitude and velocity from angular rates and specific force, and the vector algebra of turns.

Titterton & Weston, Strapdown Inertial Navigation Technology, ch. 3 and 11.
"""

from __future__ import annotations

import numpy as np

from host.compiled import Array, compiled
from host.sysid.models.templates import GRAVITY_MPS2


@compiled
def strapdown(
    rates: Array, force: Array, attitude: Array, velocity: Array, dt_s: float
) -> tuple[Array, Array]:
    """Integrate attitude (n, 3, 3; body to north-east-down) and velocity (n, 3), m/s.

    Parameters
    ----------
    rates, force : Array, shape (n, 3)
        Body axes, rad/s and m/s2 (specific force).
    attitude : Array, shape (3, 3)
        At the first sample.
    velocity : Array, shape (3,)
        At the first sample, north-east-down, m/s.
    dt_s : float
    """
    n = rates.shape[0]
    turn = np.zeros((n, 3, 3))
    moved = np.zeros((n, 3))
    turned = np.zeros((3, 3))
    for i in range(3):
        moved[0, i] = velocity[i]
        for j in range(3):
            turn[0, i, j] = attitude[i, j]
    for k in range(n - 1):
        x = 0.5 * dt_s * (rates[k, 0] + rates[k + 1, 0])
        y = 0.5 * dt_s * (rates[k, 1] + rates[k + 1, 1])
        z = 0.5 * dt_s * (rates[k, 2] + rates[k + 1, 2])
        angle = np.sqrt(x * x + y * y + z * z)
        s, c = 1.0, 0.5
        if angle > 1e-9:
            s = np.sin(angle) / angle
            c = (1.0 - np.cos(angle)) / (angle * angle)
        turned[0, 0] = 1.0 - c * (y * y + z * z)
        turned[0, 1] = c * x * y - s * z
        turned[0, 2] = c * x * z + s * y
        turned[1, 0] = c * x * y + s * z
        turned[1, 1] = 1.0 - c * (x * x + z * z)
        turned[1, 2] = c * y * z - s * x
        turned[2, 0] = c * x * z - s * y
        turned[2, 1] = c * y * z + s * x
        turned[2, 2] = 1.0 - c * (x * x + y * y)
        for i in range(3):
            felt = 0.0
            for j in range(3):
                value = 0.0
                for m in range(3):
                    value += turn[k, i, m] * turned[m, j]
                turn[k + 1, i, j] = value
                felt += turn[k, i, j] * force[k, j] + value * force[k + 1, j]
            moved[k + 1, i] = moved[k, i] + 0.5 * dt_s * felt
        moved[k + 1, 2] += GRAVITY_MPS2 * dt_s
    return turn, moved


def rotation(phi: float, theta: float, psi: float) -> Array:
    """Return the matrix (3, 3) from body axes to north-east-down; angles in rad."""
    sp, cp, st, ct = np.sin(phi), np.cos(phi), np.sin(theta), np.cos(theta)
    ss, cs = np.sin(psi), np.cos(psi)
    return np.array(
        [
            [ct * cs, sp * st * cs - cp * ss, cp * st * cs + sp * ss],
            [ct * ss, sp * st * ss + cp * cs, cp * st * ss - sp * cs],
            [-st, sp * ct, cp * ct],
        ]
    )


def small_turn(vector: Array) -> Array:
    """Return the matrix (3, 3) of a turn about an axis, given as a vector (3,), rad."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-9:
        return np.asarray(np.eye(3) + K)
    return np.asarray(
        np.eye(3) + np.sin(angle) / angle * K + (1.0 - np.cos(angle)) / angle**2 * (K @ K)
    )


def cross(vector: Array, series: Array) -> Array:
    """Return vector (3,) x series (n, 3), row by row."""
    x, y, z = vector
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(series @ K.T)


def cross_columns(series: Array, slopes: Array) -> Array:
    """Return series (n, 3) x slopes (n, 3, columns), column by column."""
    a, b = series[:, :, None], slopes
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=1,
    )
