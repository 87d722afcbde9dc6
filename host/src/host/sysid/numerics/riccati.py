"""Steady-state Kalman filter: discrete algebraic Riccati equation and innovations."""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.sysid.numerics.recursion import simulate
from host.sysid.numerics.sampled_model import SampledModel

DOUBLINGS = 40


def predicted_covariance(F: Array, C: Array, Q: Array, R: Array) -> tuple[bool, Array]:
    """Solve P = F P F' - F P C' (C P C' + R)^-1 C P F' + Q by the structured doubling algorithm.

    EQUATIONS.md, eq. 29. Chu, Fan, Lin & Wang, Structure-preserving algorithms for periodic
    discrete-time algebraic Riccati equations, International Journal of Control 77 (2004). For 5
    states and 6 outputs it takes 0.29 ms where `scipy.linalg.solve_discrete_are` takes 1.36 (same
    to rounding), and a flight's answer solves it 63 times.

    Parameters
    ----------
    F : Array, shape (n, n)
        State transition over a sample.
    C : Array, shape (p, n)
    Q : Array, shape (n, n)
        Covariance of the process noise of a sample.
    R : Array, shape (p, p)
        Covariance of the measurement noise.

    Returns
    -------
    bool
        Whether the iteration converged.
    Array, shape (n, n)
        Covariance of the predicted state.
    """
    A = F.T
    G = C.T @ np.linalg.solve(R, C)
    H = Q
    eye = np.eye(len(F))
    for _ in range(DOUBLINGS):
        W = np.linalg.inv(eye + G @ H)
        AW = A @ W
        H_next = H + A.T @ H @ W @ A
        G = G + AW @ G @ A.T
        A = AW @ A
        change = float(np.max(np.abs(H_next - H)))
        size = float(np.max(np.abs(H_next)))
        H = 0.5 * (H_next + H_next.T)
        if not size < 1e100:
            return False, H
        if change <= 1e-13 * size:
            return True, H
    return False, H


def filter_innovations(model: SampledModel, K: Array, drive: Array, y: Array) -> tuple[bool, Array]:
    """Run a constant-gain Kalman filter.

    x[k+1] = Phi (x[k] + K nu[k]) + Gamma u[k] with the innovation nu[k] = y[k] - C x[k] - D u[k]
    (EQUATIONS.md, eq. 28).

    Parameters
    ----------
    model : SampledModel
        Its start is the predicted state of the first sample.
    K : Array, shape (n, p)
        Gain of the measurement.
    drive : Array, shape (samples, w)
    y : Array, shape (samples, p)

    Returns
    -------
    bool
        Whether the state stayed finite.
    Array, shape (samples, n + w + p)
        Predicted state, drive and innovation of every sample.
    """
    n, C = len(model.start), model.C
    measured_part = y - drive @ model.read[:, n:].T
    # The filter as one recursion: nu = measured_part - C x.
    FK = model.step[:, :n] @ K
    closed_loop = np.hstack([model.step[:, :n] - FK @ C, model.step[:, n:], FK])
    finite, z = simulate(closed_loop, np.hstack([drive, measured_part]), model.start)
    if finite:
        z[:, -len(C) :] -= z[:, :n] @ C.T
    return finite, z
