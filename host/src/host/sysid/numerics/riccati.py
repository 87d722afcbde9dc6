"""Steady-state Kalman filter: Riccati equation by doubling, innovations, their slopes."""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.compiled import compiled
from host.sysid.numerics.kernels import STATE_LIMIT

DOUBLINGS = 40


def predicted_covariance(transition: Array, C: Array, Q: Array, R: Array) -> tuple[bool, Array]:
    """Solve P = F P F' - F P C' (C P C' + R)^-1 C P F' + Q by the structured doubling algorithm.

    Chu, Fan, Lin & Wang, Structure-preserving algorithms for periodic discrete-time algebraic
    Riccati equations, International Journal of Control 77 (2004). Not compiled: a fit solves it
    fewer times than loading the code of its products and inverses would be worth.
    """
    A = transition.T
    G = C.T @ np.linalg.solve(R, C)
    H = Q
    eye = np.eye(len(transition))
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


@compiled
def innovations(
    step: Array, CD: Array, K: Array, drive: Array, y: Array, start: Array, bias: Array
) -> tuple[bool, Array]:
    """Run a constant-gain Kalman filter.

    Returns
    -------
    bool
        Whether the state stayed finite.
    Array, shape (samples, n + w + p)
        Predicted state, drive and innovation of every sample.
    """
    samples, w = drive.shape
    n = start.shape[0]
    p = CD.shape[0]
    m = CD.shape[1] - n
    z = np.zeros((samples, n + w + p))
    x = start.copy()
    better = np.zeros(n)
    for k in range(samples):
        for i in range(n):
            z[k, i] = x[i]
        for j in range(w):
            z[k, n + j] = drive[k, j]
        for j in range(p):
            value = y[k, j] - bias[j]
            for i in range(n):
                value -= CD[j, i] * x[i]
            for i in range(m):
                value -= CD[j, n + i] * drive[k, i]
            z[k, n + w + j] = value
        for i in range(n):
            value = x[i]
            for j in range(p):
                value += K[i, j] * z[k, n + w + j]
            better[i] = value
        for i in range(n):
            value = 0.0
            for j in range(n):
                value += step[i, j] * better[j]
            for j in range(w):
                value += step[i, n + j] * drive[k, j]
            if not (abs(value) < STATE_LIMIT):
                return False, z
            x[i] = value
    return True, z


@compiled
def innovation_slopes(closed: Array, C: Array, start: Array, drive: Array, out: Array) -> None:
    """Run the sensitivities of a constant-gain Kalman filter.

    Parameters
    ----------
    closed : Array, shape (n, n)
        Transition of the predicted state with the gain in it.
    C : Array, shape (p, n)
    start : Array, shape (n, parameters)
        Sensitivities of the start state.
    drive : Array, shape (samples, n, parameters)
        What a sample adds to the sensitivities of the state after it.
    out : Array, shape (samples, p, parameters)
        Slopes of the innovations at a known state; those by the state are added.
    """
    samples, n, free = drive.shape
    p = C.shape[0]
    S = start.copy()
    T = np.zeros((n, free))
    for k in range(samples):
        for j in range(p):
            for i in range(n):
                f = C[j, i]
                if f != 0.0:
                    for q in range(free):
                        out[k, j, q] -= f * S[i, q]
        for i in range(n):
            for q in range(free):
                T[i, q] = drive[k, i, q]
            for j in range(n):
                f = closed[i, j]
                for q in range(free):
                    T[i, q] += f * S[j, q]
        S, T = T, S
