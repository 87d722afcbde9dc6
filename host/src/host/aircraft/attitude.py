"""Quaternions and Euler angles of whole flights."""

from __future__ import annotations

import numpy as np

from host.aircraft.airframe import Array
from host.arrays import Array as Column


def quaternion(phi_rad: float, theta_rad: float, psi_rad: float) -> Array:
    """Return the quaternion (4,), scalar first, that turns north-east-down into body axes."""
    c1, s1 = np.cos(phi_rad / 2), np.sin(phi_rad / 2)
    c2, s2 = np.cos(theta_rad / 2), np.sin(theta_rad / 2)
    c3, s3 = np.cos(psi_rad / 2), np.sin(psi_rad / 2)
    return np.array(
        [
            c1 * c2 * c3 + s1 * s2 * s3,
            s1 * c2 * c3 - c1 * s2 * s3,
            c1 * s2 * c3 + s1 * c2 * s3,
            c1 * c2 * s3 - s1 * s2 * c3,
        ]
    )


def euler(q: Array) -> tuple[Array, Array, Array]:
    """Return phi, theta, psi (rad) of quaternions (..., 4); psi within +-pi, not unwrapped."""
    q0, q1, q2, q3 = (q[..., i] for i in range(4))
    phi = np.arctan2(2 * (q2 * q3 + q0 * q1), q0**2 - q1**2 - q2**2 + q3**2)
    theta = np.arcsin(np.clip(-2 * (q1 * q3 - q0 * q2), -1.0, 1.0))
    psi = np.arctan2(2 * (q1 * q2 + q0 * q3), q0**2 + q1**2 - q2**2 - q3**2)
    return phi, theta, psi


def euler_rates(
    phi: Column, theta: Column, p: Column, q: Column, r: Column
) -> tuple[Column, Column, Column]:
    """Return the rates of phi, theta and psi (rad/s) at rates of the body (EQUATIONS.md, eq. 3)."""
    turning = q * np.sin(phi) + r * np.cos(phi)
    return (
        p + np.tan(theta) * turning,
        q * np.cos(phi) - r * np.sin(phi),
        turning / np.cos(theta),
    )


def body_rates(
    phi: Column, theta: Column, phi_radps: Column, theta_radps: Column, psi_radps: Column
) -> tuple[Column, Column, Column]:
    """Return p, q, r (rad/s) of an attitude that turns: the inverse of `euler_rates`."""
    level = psi_radps * np.cos(theta)
    return (
        phi_radps - psi_radps * np.sin(theta),
        theta_radps * np.cos(phi) + level * np.sin(phi),
        level * np.cos(phi) - theta_radps * np.sin(phi),
    )


def to_body(q: Array) -> Array:
    """Return matrices (..., 3, 3) that turn north-east-down vectors into body axes."""
    q0, q1, q2, q3 = (q[..., i] for i in range(4))
    rows = [
        [q0**2 + q1**2 - q2**2 - q3**2, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)],
        [2 * (q1 * q2 - q0 * q3), q0**2 - q1**2 + q2**2 - q3**2, 2 * (q2 * q3 + q0 * q1)],
        [2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), q0**2 - q1**2 - q2**2 + q3**2],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def multiply(a: Array, b: Array) -> Array:
    """Return the quaternion (4,) of turning by `a`, then by `b` in the turned axes."""
    a0, a1, a2, a3 = a
    b0, b1, b2, b3 = b
    return np.array(
        [
            a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
            a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
            a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
            a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
        ]
    )
