"""White process noise of a linear model: what it adds over a sample, and what it sustains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from host.arrays import Array
from host.sysid.numerics.discretisation import discretise

MOST_DECAY = 8.0  # of exp: e^8 of rounding
MOST_HALVINGS = 40


def air_states(states: Sequence[str]) -> list[int]:
    """Return which states are air, which moves already when a record begins: ``gust...``."""
    return [k for k, name in enumerate(states) if name.startswith("gust")]


def steady_covariance(A: Array, intensity: Array) -> Array:
    """Return the covariance that white process noise sustains; zero if any state does not decay.

    Parameters
    ----------
    A : Array, shape (n, n)
    intensity : Array, shape (n,)
        Spectral density of the noise in each rate.
    """
    if not len(A) or np.max(np.linalg.eigvals(A).real) >= 0.0:
        return np.zeros_like(A)
    # A P + P A' + Q = 0 (Bryson & Ho, Applied Optimal Control, sec. 11.4).
    return np.asarray(linalg.solve_continuous_lyapunov(A, -np.diag(intensity)))


def discrete_noise(A: Array, intensity: Array, dt_s: float) -> tuple[Array, Array]:
    """Return F over a sample and Q, the covariance that white process noise adds in it.

    Q is the integral of exp(A t) W exp(A' t) over the sample, computed exactly from the exponential
    of [[-A, W], [0, A']] (EQUATIONS.md, eq. 30). A trapezoid
    instead biases Cl_p by 5 % in rolling gusts at 50 Hz.

    Parameters
    ----------
    A : Array, shape (n, n)
    intensity : Array, shape (n,)
        Spectral density of each state's noise, unit of the state squared per second.
    dt_s : float
        Sample period, s.
    """
    n, halvings = len(A), halvings_of(A, dt_s)
    none = np.zeros(0, dtype=np.int64)
    part_s = dt_s / 2.0**halvings
    E, _ = discretise(
        van_loan(A, intensity), 2 * n, 0, False, part_s, none, none, none, np.zeros(0), 0
    )
    F = np.ascontiguousarray(E[n:, n : 2 * n].T)
    with np.errstate(over="ignore", invalid="ignore"):  # of a model that diverges within a sample
        Qd = F @ E[:n, n : 2 * n]
        for _ in range(halvings):
            Qd, F = Qd + F @ Qd @ F.T, F @ F
    return F, 0.5 * (Qd + Qd.T)


def halvings_of(A: Array, dt_s: float) -> int:
    """Return how often to halve a sample so that nothing decays by more than `MOST_DECAY` in it.

    The exponential has what grows as fast as states decay: where that is 1e16, Q is rounding.
    """
    norm = float(np.max(np.sum(np.abs(A), axis=1), initial=0.0)) * dt_s
    if not MOST_DECAY < norm < np.inf:
        return 0
    return min(int(np.ceil(np.log2(norm / MOST_DECAY))), MOST_HALVINGS)


def van_loan(A: Array, intensity: Array) -> Array:
    """Return [-A Q; 0 A'] and a column of zeros: its exponential holds the covariance."""
    n = len(A)
    block = np.zeros((2 * n, 2 * n + 1))
    block[:n, :n] = -A
    block[:n, n : 2 * n] = np.diag(intensity)
    block[n:, n : 2 * n] = A.T
    return block
