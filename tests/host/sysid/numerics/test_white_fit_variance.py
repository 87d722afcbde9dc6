"""Variance of white output error in noise with a memory that all outputs share: against draws."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from host.arrays import Array, IntArray
from host.sysid.numerics import ArNoise
from host.sysid.numerics.score_variance import _by_innovations, white_fit_variance
from scipy.signal import lfilter

SAMPLES, DRAWS = 400, 600
MEMORY = (np.array([0.9]), np.array([1.5, -0.7]))
SIZE = np.array([0.02, 0.03])  # deviation of the innovations


@dataclass
class TwoLines:
    """Two outputs, straight in two parameters that both outputs tell."""

    slopes: Array  # (2, samples, 2)
    left: Array = field(default_factory=lambda: np.zeros((2, SAMPLES)))
    least_variance: float = 1e-12

    def __post_init__(self) -> None:
        self.maneuvers = (SimpleNamespace(dt_s=0.05, samples=SAMPLES),)
        self.counts = np.full(2, float(SAMPLES))
        self.prior_precision = np.zeros(2)

    def residual(self, number: int, y: Array) -> Array:
        return self.left

    def columns(self, number: int) -> IntArray:
        return np.arange(2)

    def seen(self, number: int, output: int) -> None:
        return None


def _noise(rng: np.random.Generator, together: float) -> Array:
    both = rng.standard_normal((2, SAMPLES + 200))
    both[1] = together * both[0] + np.sqrt(1.0 - together**2) * both[1]
    made = [
        lfilter([size], [1.0, *-coefficient], row)
        for size, coefficient, row in zip(SIZE, MEMORY, both, strict=True)
    ]
    return np.array(made)[:, 200:]


@pytest.mark.parametrize("together", [-0.9, 0.9])
def test_variance_is_that_of_draws(together: float) -> None:
    """A gust that moves both outputs counts between them: without, +-0.9 are as none."""
    rng = np.random.default_rng(11)
    t = np.arange(SAMPLES) * 0.05
    slopes = np.stack([
        np.column_stack([np.sin(1.1 * t), np.cos(0.4 * t)]),
        np.column_stack([np.sin(1.1 * t + 0.3), 0.5 * np.cos(0.4 * t)]),
    ])  # fmt: skip
    memories = [ArNoise.from_coefficient(a) for a in MEMORY]
    problem, estimates, told = TwoLines(slopes), [], []
    usual = np.mean([_noise(rng, together) ** 2 for _ in range(20)], axis=(0, 2))
    weight = 1.0 / usual
    M = np.einsum("j,jtk,jtl->kl", weight, slopes, slopes)
    for number in range(DRAWS):
        noise = _noise(rng, together)
        step = np.linalg.solve(M, np.einsum("j,jtk,jt->k", weight, slopes, noise))
        estimates.append(step)
        if number % 20 == 0:
            problem.left = noise - slopes @ step
            told.append(white_fit_variance(_any(problem), _responses(slopes), memories, SIZE**2))
    drawn = np.var(estimates, axis=0)
    np.testing.assert_allclose(np.mean(told, axis=0), drawn, rtol=0.2)


def _any(value: object) -> Any:
    return value


def _responses(slopes: Array) -> list[Any]:
    return [SimpleNamespace(y=np.zeros((2, SAMPLES)), sensitivities=slopes)]


def test_slopes_by_innovations() -> None:
    """S' n = G' e for a noise that begins at rest."""
    rng = np.random.default_rng(2)
    e, slopes = rng.standard_normal(50), rng.standard_normal((50, 3))
    n = np.zeros(50)
    for t in range(50):
        n[t] = e[t] + sum(a * n[t - k] for k, a in enumerate(MEMORY[1], start=1) if t >= k)
    np.testing.assert_allclose(_by_innovations(MEMORY[1], slopes).T @ e, slopes.T @ n)
