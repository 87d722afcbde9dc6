"""The original ArduIMU's attitude algorithm, from its published description.

Direction cosines driven by the rates, with proportional and integral drift
correction by accelerometer and compass (W. Premerlani & P. Bizard, Direction
Cosine Matrix IMU: Theory, 2009, equations 16 to 29). Gains, weighting and
whole metres per second of GPS speed as in ArduIMU 1.9.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

PERIOD_S = 0.02
COMPASS_STEPS = 6
TILT_GAIN = 1.515  # rad/s per rad
TILT_INTEGRAL = 0.00101  # rad/s per rad and step
HEADING_GAIN = 1.2
HEADING_INTEGRAL = 0.00005
GRAVITY_MPS2 = 9.81


def run(
    rates_radps: NDArray[np.float64],
    force_mps2: NDArray[np.float64],
    *,
    field: NDArray[np.float64],
    declination_rad: float,
    speed_mps: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Run the algorithm over samples 20 ms apart.

    Parameters
    ----------
    rates_radps, force_mps2 : (n, 3) arrays
        Body axes, specific force.
    field : (n, 3) array
        Magnetic field in body axes, any scale; every sixth sample is used.
    declination_rad : float
    speed_mps : (n,) array
        GPS ground speed held between fixes; whole metres per second are used.

    Returns
    -------
    (n, 3) array
        phi, theta, psi in rad.
    """
    c = np.eye(3)
    proportional, integral = np.zeros(3), np.zeros(3)
    out = np.zeros((len(rates_radps), 3))
    course_rad = 0.0
    for i in range(len(rates_radps)):
        rate = rates_radps[i] + integral
        total = rate + proportional
        speed = math.floor(speed_mps[i])
        felt = -force_mps2[i] / GRAVITY_MPS2  # minus specific force, in g
        felt[1] += speed * rate[2] / GRAVITY_MPS2
        felt[2] -= speed * rate[1] / GRAVITY_MPS2
        turn = PERIOD_S * np.array(
            [[0.0, -total[2], total[1]], [total[2], 0.0, -total[0]], [-total[1], total[0], 0.0]]
        )
        c = _normalised(c + c @ turn)
        weight = min(max(1.0 - 2.0 * abs(1.0 - float(np.linalg.norm(felt))), 0.0), 1.0)
        tilt = np.cross(felt, c[2])
        if i % COMPASS_STEPS == 0:
            phi, theta, _ = _euler(c)
            course_rad = heading(field[i], phi, theta, declination_rad)
        course = c[0, 0] * math.sin(course_rad) - c[1, 0] * math.cos(course_rad)
        proportional = tilt * TILT_GAIN * weight + c[2] * course * HEADING_GAIN
        integral = integral + tilt * TILT_INTEGRAL * weight + c[2] * course * HEADING_INTEGRAL
        out[i] = _euler(c)
    return out


def heading(
    field: NDArray[np.float64], phi_rad: float, theta_rad: float, declination_rad: float
) -> float:
    """Return the tilt-compensated heading (rad) of a field (3,) in body axes."""
    level = field[1] * math.sin(phi_rad) + field[2] * math.cos(phi_rad)
    x = field[0] * math.cos(theta_rad) + level * math.sin(theta_rad)
    y = field[1] * math.cos(phi_rad) - field[2] * math.sin(phi_rad)
    return math.atan2(-y, x) + declination_rad


def _normalised(c: NDArray[np.float64]) -> NDArray[np.float64]:
    error = -0.5 * float(c[0] @ c[1])
    x, y = c[0] + error * c[1], c[1] + error * c[0]
    rows = np.array([x, y, np.cross(x, y)])
    return np.asarray(rows * (0.5 * (3.0 - (rows**2).sum(axis=1)))[:, None])


def _euler(c: NDArray[np.float64]) -> tuple[float, float, float]:
    return (
        math.atan2(c[2, 1], c[2, 2]),
        -math.asin(min(max(c[2, 0], -1.0), 1.0)),
        math.atan2(c[1, 0], c[0, 0]),
    )
