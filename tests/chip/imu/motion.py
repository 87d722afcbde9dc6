"""Motions for the sensors of a simulated IMU: rest, and flight that moves every axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from simavr_bench import Magnetometer, Mpu6000
from simavr_bench.imu_sensors import G0_MPS2

STEP_S = 0.02
# Field at 25 deg north, as the declination of the default settings: tesla, north east down.
FIELD_NED_T = np.array([0.350e-4, 0.025e-4, 0.260e-4])

Array = NDArray[np.float64]


def swaying(time_s: float, *, seed: int = 1) -> tuple[Array, Array, Array]:
    """Give smooth rates and specific forces as of brisk flying, every axis at its own rhythm.

    Parameters
    ----------
    time_s : float
        Length.
    seed : int
        Seed of rhythms and phases.

    Returns
    -------
    at_s : NDArray, shape (n,)
        Points, 50 a second.
    rates_radps, force_mps2 : NDArray, shape (n, 3)
        Body axes, within 2.5 rad/s and 16 m/s2 of -g down.
    """
    rng = np.random.default_rng(seed)
    at_s = np.arange(0.0, time_s + STEP_S, STEP_S)

    def waves(size: float) -> Array:
        hz, phase = rng.uniform(0.1, 2.0, (3, 3)), rng.uniform(0, 2 * np.pi, (3, 3))
        angle = 2 * np.pi * hz[..., None] * at_s + phase[..., None]
        return np.asarray(size / 3 * np.sin(angle).sum(axis=1).T, np.float64)

    force = waves(16.0)
    force[:, 2] -= G0_MPS2
    return at_s, waves(2.5), force


def fly(
    mpu: Mpu6000, magnetometer: Magnetometer, time_s: float, *, seed: int = 1, rest_s: float = 0.0
) -> None:
    """Let both sensors sway for a time, from `rest_s` on, and the field turn."""
    at_s, rates, force = swaying(time_s, seed=seed)
    if rest_s > 0.0:
        at_s = np.concatenate(([0.0, rest_s - 0.01], at_s + rest_s))
        rates = np.vstack((np.zeros((2, 3)), rates))
        force = np.vstack((np.tile([0.0, 0.0, -9.80665], (2, 1)), force))
    mpu.motion(at_s, rates, force)
    turn = 2 * np.pi * 0.05 * at_s
    field = np.column_stack(
        (
            FIELD_NED_T[0] * np.cos(turn),
            -FIELD_NED_T[0] * np.sin(turn),
            np.full_like(turn, FIELD_NED_T[2]),
        )
    )
    magnetometer.field(at_s, field)
