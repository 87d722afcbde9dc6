"""Steady-state Kalman filter: Riccati equation by doubling, innovations of a record."""

from __future__ import annotations

import numpy as np

from host.compiled import Array, compiled
from host.sysid.numerics.kernels import STATE_LIMIT

DOUBLINGS = 40


@compiled
def predicted_covariance(transition: Array, C: Array, Q: Array, R: Array) -> tuple[bool, Array]:
    """Solve P = F P F' - F P C' (C P C' + R)^-1 C P F' + Q by the structured doubling algorithm.

    Chu, Fan, Lin & Wang, Structure-preserving algorithms for periodic discrete-time algebraic
    Riccati equations, International Journal of Control 77 (2004).
    """
    n = transition.shape[0]
    A = transition.T.copy()
    G = C.T @ np.linalg.solve(R, C)
    H = Q.copy()
    eye = np.eye(n)
    for _ in range(DOUBLINGS):
        W = np.linalg.inv(eye + G @ H)
        AW = A @ W
        H_next = H + A.T @ H @ W @ A
        G = G + AW @ G @ A.T
        A = AW @ A
        change = 0.0
        size = 0.0
        for i in range(n):
            for j in range(n):
                change = max(change, abs(H_next[i, j] - H[i, j]))
                size = max(size, abs(H_next[i, j]))
        H = 0.5 * (H_next + H_next.T)
        if not (size < 1e100):
            return False, H
        if change <= 1e-13 * size:
            return True, H
    return False, H


@compiled
def innovations(
    step: Array, CD: Array, K: Array, drive: Array, y: Array, start: Array, bias: Array
) -> tuple[bool, Array]:
    """Run a constant-gain Kalman filter; returns innovations (samples, p)."""
    samples, w = drive.shape
    n = start.shape[0]
    p = CD.shape[0]
    m = CD.shape[1] - n
    e = np.zeros((samples, p))
    x = start.copy()
    better = np.zeros(n)
    for k in range(samples):
        for j in range(p):
            value = y[k, j] - bias[j]
            for i in range(n):
                value -= CD[j, i] * x[i]
            for i in range(m):
                value -= CD[j, n + i] * drive[k, i]
            e[k, j] = value
        for i in range(n):
            value = x[i]
            for j in range(p):
                value += K[i, j] * e[k, j]
            better[i] = value
        for i in range(n):
            value = 0.0
            for j in range(n):
                value += step[i, j] * better[j]
            for j in range(w):
                value += step[i, n + j] * drive[k, j]
            if not (abs(value) < STATE_LIMIT):
                return False, e
            x[i] = value
    return True, e
