"""Attitude and velocity from angular rates and specific force, their slopes, algebra of turns.

Titterton & Weston, Strapdown Inertial Navigation Technology, ch. 3 and 11.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array, IntArray
from host.compiled import compiled
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


@compiled
def path_slopes(
    C: Array,
    rates: Array,
    force: Array,
    felt: Array,
    through: Array,
    size: Array,
    place: IntArray,
    wind: IntArray,
    own: int,
    step_s: float,
    early: float,
    velocity: Array,
    fall: Array,
    air: Array,
) -> None:
    """Integrate how errors of the inertial sensors turn and move the path, block by block.

    Parameters
    ----------
    C : Array, shape (blocks, 3, 3)
        Body to north-east-down.
    rates, force : Array, shape (blocks, 3)
        Without errors of bias and scale, not yet turned by the tilt.
    felt, through : Array, shape (blocks, 3)
        Specific force and velocity through the air, north-east-down.
    size : Array, shape (2, 3)
        One plus scale error of gyro and accelerometer.
    place : IntArray, shape (2, 3, 3)
        Columns of bias, scale and tilt of the axes of gyro and accelerometer, -1 if known.
    wind : IntArray, shape (2,)
        Columns of the wind to north and east, -1 if known.
    own : int
        First column of the errors of the start: of velocity, then of attitude.
    step_s, early : float
        Length of a block, and the share of the first that lies before the first sample.
    velocity, air : Array, shape (blocks, 3, unknowns)
        Overwritten: slopes over the ground, and through the air in body axes.
    fall : Array, shape (blocks, unknowns)
        Overwritten: slopes of the way downwards, m.
    """
    free = velocity.shape[2]
    turned, moved, fallen = np.zeros((3, free)), np.zeros((3, free)), np.zeros((1, free))
    E, by_rates, by_force = np.zeros((3, free)), np.zeros((3, free)), np.zeros((3, free))
    for k in range(C.shape[0]):
        _shares(C[k], rates[k], size[0], place[0], by_rates)
        _to_middle(by_rates, step_s, early if k == 0 else 0.0, turned, E)
        for i in range(3):
            E[i, own + 3 + i] += 1.0
        _shares(C[k], force[k], size[1], place[1], by_force)
        V = velocity[k]
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            for q in range(free):
                by_force[i, q] -= felt[k, a] * E[b, q] - felt[k, b] * E[a, q]
        _to_middle(by_force, step_s, early if k == 0 else 0.0, moved, V)
        for i in range(3):
            V[i, own + i] += 1.0
        _to_middle(V[2:], step_s, early if k == 0 else 0.0, fallen, fall[k : k + 1])
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            for q in range(free):
                by_force[i, q] = V[i, q] + through[k, a] * E[b, q] - through[k, b] * E[a, q]
        for i in range(2):
            if wind[i] >= 0:
                by_force[i, wind[i]] -= 1.0
        for i in range(3):
            for q in range(free):
                air[k, i, q] = (
                    C[k, 0, i] * by_force[0, q]
                    + C[k, 1, i] * by_force[1, q]
                    + C[k, 2, i] * by_force[2, q]
                )


@compiled
def _shares(C: Array, signal: Array, size: Array, place: IntArray, out: Array) -> None:
    """Put what errors of a triple of sensors make of its signal, turned by C, into `out`."""
    for i in range(3):
        for q in range(out.shape[1]):
            out[i, q] = 0.0
        for axis in range(3):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            if place[axis, 0] >= 0:
                out[i, place[axis, 0]] -= C[i, axis] / size[axis]
            if place[axis, 1] >= 0:
                out[i, place[axis, 1]] -= C[i, axis] * signal[axis] / size[axis]
            if place[axis, 2] >= 0:  # a turn about the axis
                out[i, place[axis, 2]] += C[i, b] * signal[a] - C[i, a] * signal[b]


@compiled
def _to_middle(mean: Array, step_s: float, early: float, total: Array, out: Array) -> None:
    """Integrate a block's mean to its middle into `out`, to its end into `total`."""
    for i in range(mean.shape[0]):
        for q in range(mean.shape[1]):
            total[i, q] -= early * mean[i, q]
            out[i, q] = step_s * (total[i, q] + 0.5 * mean[i, q])
            total[i, q] += mean[i, q]


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
