"""Linear systems of the studies: their motion under a held input, and stable ones at random."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from host.arrays import Array
from scipy import linalg, signal


def simulated(A: Array, B: Array, u: Array, dt_s: float) -> Array:
    """Return the states of a linear system from rest under a held input, (samples, n)."""
    n = len(A)
    discrete = signal.cont2discrete((A, B, np.eye(n), np.zeros((n, u.shape[1]))), dt_s)
    x = np.zeros((len(u), n))
    for k in range(len(u) - 1):
        x[k + 1] = discrete[0] @ x[k] + discrete[1] @ u[k]
    return x


def random_system(rng: np.random.Generator, states: int = 4) -> tuple[Array, Array]:
    """Return a stable system of one input as `rss` of MATLAB and python-control draws it.

    Every pole repeats the one before it with probability 0.05, else it is real with probability
    0.6; real parts are minus log-normal, imaginary parts three times log-normal, both with unit
    deviation in the logarithm. States are mixed by a normal matrix; each entry of B is normal and
    kept with probability 0.8.
    """
    blocks: list[Array] = []
    left = states
    while left > 0:
        if blocks and left >= len(blocks[-1]) and left > 1 and rng.random() < 0.05:
            block = blocks[-1]
        elif left == 1 or rng.random() < 0.6:
            block = np.array([[-np.exp(rng.standard_normal())]])
        else:
            real, imaginary = -np.exp(rng.standard_normal()), 3.0 * np.exp(rng.standard_normal())
            block = np.array([[real, imaginary], [-imaginary, real]])
        blocks.append(block)
        left -= len(block)
    mix = rng.standard_normal((states, states))
    A = np.linalg.solve(mix, linalg.block_diag(*blocks) @ mix)
    B = rng.standard_normal((states, 1))
    while True:
        kept = rng.random((states, 1)) < 0.8
        if kept.any():
            return A, B * kept


def mixed_modes(rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a stable system of two to four states and one input, harder to decide about.

    Poles are drawn between 0.3 and 6 rad/s with damping 0.1 to 1, then mixed by a random change of
    states near the identity: most entries count, and more bounds lie near 100 %.
    """
    n = int(rng.integers(2, 5))
    blocks: list[Array] = []
    for _ in range(n // 2):
        frequency = float(np.exp(rng.uniform(np.log(0.3), np.log(6.0))))
        damping = rng.uniform(0.1, 1.0)
        turn = frequency * np.sqrt(1.0 - damping**2)
        blocks.append(np.array([[-damping * frequency, turn], [-turn, -damping * frequency]]))
    if n % 2:
        blocks.append(np.array([[-np.exp(rng.uniform(np.log(0.3), np.log(6.0)))]]))
    mix = np.eye(n) + 0.5 * rng.standard_normal((n, n))
    while np.linalg.cond(mix) > 20.0:
        mix = np.eye(n) + 0.5 * rng.standard_normal((n, n))
    A = mix @ linalg.block_diag(*blocks) @ np.linalg.inv(mix)
    return A, mix @ rng.standard_normal((n, 1))


DRAWS: dict[str, Callable[[np.random.Generator], tuple[Array, Array]]] = {
    "rss, 4 states": random_system,
    "mixed modes, 2-4 states": mixed_modes,
}
