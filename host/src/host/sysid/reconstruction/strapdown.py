"""Strapdown integration of attitude and velocity, and its sensitivities to sensor errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.aircraft.attitude import body_rates
from host.arrays import Array, IntArray
from host.constants import GRAVITY_MPS2


def zeros_by_attitude(
    columns: Mapping[str, Array], cuts: Sequence[slice], dt_s: float
) -> list[float]:
    """Return by how much gyros turn faster than the attitude, rad/s; nothing without attitude.

    Where a path is integrated from zeros of 20 deg/s (MPU-6000 data sheet), no search converges.

    Parameters
    ----------
    columns : mapping of (n,) Array
    cuts : sequence of slice
        Samples that count.
    dt_s : float
    """
    attitude = ("phi_rad", "theta_rad", "psi_rad")
    if not all(name in columns for name in attitude):
        return []
    phi, theta, psi = (np.unwrap(columns[name]) for name in attitude)
    turned = body_rates(phi, theta, *(np.gradient(x, dt_s) for x in (phi, theta, psi)))
    inside = np.concatenate([np.arange(c.start, c.stop) for c in cuts])
    return [
        float(np.mean((columns[f"{axis}_radps"] - own)[inside]))
        for axis, own in zip("pqr", turned, strict=True)
    ]


def strapdown(
    rates: Array, force: Array, attitude: Array, velocity: Array, dt_s: float
) -> tuple[Array, Array]:
    """Integrate attitude (n, 3, 3; body to north-east-down) and velocity (n, 3), m/s.

    C[k+1] = C[k] exp([omega x] dt), v' = C f + g over a flat, non-rotating earth (EQUATIONS.md,
    eq. 16).

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
    turn = _accumulated_rotations(attitude, _rotations(0.5 * dt_s * (rates[:-1] + rates[1:])))
    acceleration_ned = np.einsum("nij,nj->ni", turn, force)
    increments = 0.5 * dt_s * (acceleration_ned[:-1] + acceleration_ned[1:])
    increments[:, 2] += GRAVITY_MPS2 * dt_s
    return turn, np.cumsum(np.vstack([velocity, increments]), axis=0)


def _rotations(angle: Array) -> Array:
    """Return the rotation matrices (n, 3, 3) of rotation vectors (n, 3), rad.

    Rodrigues' formula, I + sin(a)/a K + (1 - cos(a))/a^2 K^2.
    """
    x, y, z = angle.T
    size = np.sqrt(x * x + y * y + z * z)
    small = size <= 1e-9
    safe = np.where(small, 1.0, size)
    s = np.where(small, 1.0, np.sin(safe) / safe)
    c = np.where(small, 0.5, (1.0 - np.cos(safe)) / (safe * safe))
    turn = np.empty((len(angle), 3, 3))
    turn[:, 0, 0] = 1.0 - c * (y * y + z * z)
    turn[:, 0, 1] = c * x * y - s * z
    turn[:, 0, 2] = c * x * z + s * y
    turn[:, 1, 0] = c * x * y + s * z
    turn[:, 1, 1] = 1.0 - c * (x * x + z * z)
    turn[:, 1, 2] = c * y * z - s * x
    turn[:, 2, 0] = c * x * z - s * y
    turn[:, 2, 1] = c * y * z + s * x
    turn[:, 2, 2] = 1.0 - c * (x * x + y * y)
    return turn


def _accumulated_rotations(attitude: Array, turns: Array) -> Array:
    """Return an attitude and its products with successive rotations, (n + 1, 3, 3).

    The record is cut into about as many pieces as each has samples, all multiplied side by side.
    """
    length = max(1, round(len(turns) ** 0.5))
    pieces = -(-len(turns) // length)
    rows = np.empty((pieces * length, 3, 3))
    rows[: len(turns)] = turns
    rows[len(turns) :] = np.eye(3)
    rows = rows.reshape(pieces, length, 3, 3)
    for k in range(1, length):
        rows[:, k] = rows[:, k - 1] @ rows[:, k]
    begins = np.empty((pieces + 1, 3, 3))
    begins[0] = attitude
    for k in range(pieces):
        begins[k + 1] = begins[k] @ rows[k, -1]
    result = np.empty((len(turns) + 1, 3, 3))
    result[0] = attitude
    result[1:] = (begins[:-1, None] @ rows).reshape(-1, 3, 3)[: len(turns)]
    return result


def path_sensitivities(
    C: Array,
    rates: Array,
    force: Array,
    force_ned: Array,
    air_velocity: Array,
    size: Array,
    place: IntArray,
    wind: IntArray,
    own: int,
    turn_slope: Array,
    step_s: float,
    early: float,
    width: int,
) -> tuple[Array, Array, Array]:
    """Integrate the sensitivities of attitude and velocity to errors of the inertial sensors.

    The attitude error psi (small rotation, earth axes) obeys psi' = C d_omega, the velocity error
    d_v' = C d_f - (C f) x psi, with errors d_omega and d_f of the measured rates and forces
    (EQUATIONS.md, eq. 17).

    Parameters
    ----------
    C : Array, shape (blocks, 3, 3)
        Body to north-east-down.
    rates, force : Array, shape (blocks, 3)
        Corrected for bias and scale, rad/s and m/s2, not for misalignment.
    force_ned, air_velocity : Array, shape (blocks, 3)
        Specific force, m/s2, and velocity relative to the air, m/s, both north-east-down.
    size : Array, shape (2, 3)
        One plus the scale error of gyro and accelerometer.
    place : IntArray, shape (2, 3, 3)
        Columns of bias, scale and misalignment of gyro and accelerometer axes, -1 if known.
    wind : IntArray, shape (2,)
        Columns of the wind to north and east, -1 if known.
    own : int
        First column of the initial errors: of velocity, then of attitude.
    turn_slope : Array, shape (3, 3)
        `rotation_slope` of the initial attitude's rotation vector.
    step_s, early : float
        Length of a block, s, and the share of the first block before the first sample.
    width : int
        Unknowns.

    Returns
    -------
    Array, shape (blocks, 3, width)
        Sensitivities of the velocity over the ground.
    Array, shape (blocks, width)
        Sensitivities of the distance downwards, m.
    Array, shape (blocks, 3, width)
        Sensitivities of the velocity relative to the air, body axes.
    """
    axes = np.arange(3)
    attitude_error = _integral_to_middle(
        _sensor_error_effect(C, rates, size[0], place[0], width), step_s, early
    )
    attitude_error[:, :, own + 3 : own + 6] += turn_slope
    acceleration_error = _sensor_error_effect(C, force, size[1], place[1], width) - np.cross(
        force_ned[:, :, None], attitude_error, axis=1
    )
    ground = _integral_to_middle(acceleration_error, step_s, early)
    ground[:, axes, own + axes] += 1.0
    fall = _integral_to_middle(ground[:, 2], step_s, early)
    air_velocity_error = ground + np.cross(air_velocity[:, :, None], attitude_error, axis=1)
    for axis in np.flatnonzero(wind >= 0):
        air_velocity_error[:, axis, wind[axis]] -= 1.0
    return ground, fall, C.transpose(0, 2, 1) @ air_velocity_error


def _sensor_error_effect(
    C: Array, signal: Array, size: Array, place: IntArray, width: int
) -> Array:
    """Return derivatives of a sensor triad's corrected signal by its errors, rotated by C."""
    out = np.zeros((len(C), 3, width))
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        bias, scale, tilt = place[axis]
        if bias >= 0:
            out[:, :, bias] -= C[:, :, axis] / size[axis]
        if scale >= 0:
            out[:, :, scale] -= C[:, :, axis] * (signal[:, axis, None] / size[axis])
        if tilt >= 0:  # a rotation about the axis
            out[:, :, tilt] += C[:, :, b] * signal[:, a, None] - C[:, :, a] * signal[:, b, None]
    return out


def _integral_to_middle(mean: Array, step_s: float, early: float) -> Array:
    """Integrate means of blocks to the middle of each."""
    return np.asarray(step_s * (np.cumsum(mean, axis=0) - 0.5 * mean - early * mean[0]))


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


def rotation_from_vector(vector: Array) -> Array:
    """Return the rotation matrix (3, 3) of a rotation vector (3,), rad (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-9:
        return np.asarray(np.eye(3) + K)
    return np.asarray(
        np.eye(3) + np.sin(angle) / angle * K + (1.0 - np.cos(angle)) / angle**2 * (K @ K)
    )


def rotation_slope(vector: Array) -> Array:
    """Return the small rotation, earth axes, by which a change of a rotation vector turns further.

    The left Jacobian (3, 3) of Barfoot, State Estimation for Robotics, (7.77). It is the unit
    matrix only where nothing is turned yet.
    """
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-9:
        return np.asarray(np.eye(3) + 0.5 * K)
    half = (1.0 - np.cos(angle)) / angle**2
    return np.asarray(np.eye(3) + half * K + (angle - np.sin(angle)) / angle**3 * (K @ K))


def cross(vector: Array, series: Array) -> Array:
    """Return vector (3,) x series (n, 3), row by row."""
    x, y, z = vector
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(series @ K.T)
