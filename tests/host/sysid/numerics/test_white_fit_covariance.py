"""Covariance of white output error in noise with a memory that all outputs share: against draws."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from host.arrays import Array, IntArray
from host.sysid.numerics.joint_noise import JointNoise
from host.sysid.numerics.score_variance import white_fit_covariance
from scipy.signal import lfilter

SAMPLES, DRAWS = 400, 600
MEMORY = (np.array([0.9]), np.array([1.5, -0.7]))
SIZE = np.array([0.02, 0.03])  # deviation of the innovations
LATER = 3  # samples from a gust at the first output to the same at the second


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


def _noise(rng: np.random.Generator, together: float, later: int) -> Array:
    both = rng.standard_normal((2, SAMPLES + 200))
    gust = np.roll(both[0], later)
    both[1] = together * gust + np.sqrt(1.0 - together**2) * both[1]
    made = [
        lfilter([size], [1.0, *-coefficient], row)
        for size, coefficient, row in zip(SIZE, MEMORY, both, strict=True)
    ]
    return np.array(made)[:, 200:]


def _memory(together: float, later: int) -> JointNoise:
    coefficients, covariance = np.zeros((LATER + 1, 2, 2)), np.diag(SIZE**2)
    for j, own in enumerate(MEMORY):
        coefficients[: len(own), j, j] = own
    if later == 0:
        covariance[0, 1] = covariance[1, 0] = together * SIZE[0] * SIZE[1]
    else:  # the innovation of the first, which is what its autoregression leaves
        share = together * SIZE[1] / SIZE[0]
        coefficients[later - 1 : later + 1, 1, 0] = share, -share * MEMORY[0][0]
        covariance[1, 1] *= 1.0 - together**2
    return JointNoise(coefficients, covariance)


@pytest.mark.parametrize(("together", "later"), [(-0.9, 0), (0.9, 0), (0.9, LATER), (-0.9, LATER)])
def test_covariance_is_that_of_draws(together: float, later: int) -> None:
    """A gust that moves both outputs counts between them, at once or one after the other."""
    rng = np.random.default_rng(11)
    t = np.arange(SAMPLES) * 0.05
    slopes = np.stack([
        np.column_stack([np.sin(1.1 * t), np.cos(0.4 * t)]),
        np.column_stack([np.sin(1.1 * t + 0.3), 0.5 * np.cos(0.4 * t)]),
    ])  # fmt: skip
    problem, estimates, told = TwoLines(slopes), [], []
    usual = np.mean([_noise(rng, together, later) ** 2 for _ in range(20)], axis=(0, 2))
    weight = 1.0 / usual
    M = np.einsum("j,jtk,jtl->kl", weight, slopes, slopes)
    for number in range(DRAWS):
        noise = _noise(rng, together, later)
        step = np.linalg.solve(M, np.einsum("j,jtk,jt->k", weight, slopes, noise))
        estimates.append(step)
        if number % 20 == 0:
            problem.left = noise - slopes @ step
            memory = _memory(together, later)
            told.append(white_fit_covariance(_any(problem), _responses(slopes), memory))
    drawn, found = np.cov(np.transpose(estimates)), np.mean(told, axis=0)
    np.testing.assert_allclose(np.diag(found), np.diag(drawn), rtol=0.2)
    size = np.sqrt(np.diag(drawn))
    np.testing.assert_allclose(found / np.outer(size, size), drawn / np.outer(size, size), atol=0.2)


def _any(value: object) -> Any:
    return value


def _responses(slopes: Array) -> list[Any]:
    return [SimpleNamespace(y=np.zeros((2, SAMPLES)), sensitivities=slopes)]
