"""Covariance of white output error in noise with a memory that all outputs share: against draws."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from host.aircraft.air import Air, gusts, turbulence
from host.arrays import Array, IntArray
from host.sysid.estimators import fit
from host.sysid.models import Maneuver, Trim, template
from host.sysid.numerics import output_problem
from host.sysid.numerics.joint_noise import JointNoise, noise_of_outputs
from host.sysid.numerics.score_variance import white_fit_covariance
from scipy import linalg, signal

SAMPLES, DRAWS = 400, 600
MEMORY = (np.array([0.9]), np.array([1.5, -0.7]))
SIZE = np.array([0.02, 0.03])  # deviation of the innovations
LATER = 3  # samples from a gust at the first output to the same at the second
V_MPS, SPAN_M, DT_S, ROWS, BEFORE = 17.0, 1.26, 0.01, 430, 600
SENSORS = np.array([0.002, 0.003, 0.003, 0.003, 0.05])  # deviations
TRUTH = {
    "Y_beta": -0.2, "L_beta": -70.0, "L_p": -22.5, "L_r": 5.2, "L_da": 340.0, "L_dr": 1.6,
    "N_beta": 34.0, "N_p": -0.6, "N_r": -1.4, "N_da": 1.5, "N_dr": -30.0,
}  # fmt: skip
YAW = ("N_beta", "N_p", "N_r", "N_da", "N_dr")
BASE = template("lateral", Trim(V_MPS, 0.1, 0.09))
THETA = np.array([TRUTH.get(name, 0.0) for name in BASE.parameter_names])


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
        signal.lfilter([size], [1.0, *-coefficient], row)
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


def doublets(surface: int) -> Array:
    """Return two doublets of one surface, the other still."""
    u, t = np.zeros((ROWS, 2)), np.arange(ROWS) * DT_S
    for start_s in (0.3, 1.4):
        u[:, surface] += 0.07 * ((t > start_s) & (t < start_s + 0.4))
        u[:, surface] -= 0.07 * ((t > start_s + 0.4) & (t < start_s + 0.8))
    return u


INPUTS = [doublets(0), doublets(0), doublets(1), doublets(1)]


def wind(rng: np.random.Generator) -> Array:
    """Return sideslip, roll and yaw rate of gusts of 0.3 m/s that turn and roll the air too."""
    noise = rng.standard_normal(((BEFORE + ROWS) * 10, 4))
    air = turbulence(Air(turbulence_mps=0.3), 60.0)
    drawn = gusts(air, noise, V_MPS, SPAN_M, DT_S / 10)[::10]
    return np.column_stack([drawn[:, 1] / V_MPS, -drawn[:, 3], -drawn[:, 5]])


def flown(u: Array, winds: Array) -> Array:
    """Return the outputs of maneuvers, one for each wind; winds (n, samples, 3)."""
    A, B, C, D = BASE.matrices(THETA)
    still, _, seen, _ = BASE.matrices(np.zeros(len(THETA)))
    felt, measured = (A - still)[:, :3], (C - seen)[:, :3]  # by beta, p, r of the air
    measured[0, 0] = 1.0  # the vane
    surfaces = np.broadcast_to(np.vstack([np.zeros((BEFORE, 2)), u]), (*winds.shape[:2], 2))
    driven = np.concatenate([surfaces, winds], axis=2)
    whole = np.zeros((len(A) + 10, len(A) + 10))  # lines from sample to sample
    whole[: len(A), : len(A)], whole[: len(A), len(A) : -5] = A, np.hstack([B, felt])
    whole[len(A) : -5, -5:] = np.eye(5) / DT_S
    ahead = linalg.expm(DT_S * whole)[: len(A)].T
    x = np.zeros((BEFORE + ROWS, len(winds), len(A)))
    for k in range(len(x) - 1):
        here, change = driven[:, k], driven[:, k + 1] - driven[:, k]
        x[k + 1] = np.hstack([x[k], here, change]) @ ahead
    y = x.swapaxes(0, 1) @ C.T + driven @ np.hstack([D, measured]).T
    return np.asarray(y[:, BEFORE:])


def test_the_covariance_of_a_white_fit_is_that_of_drawn_gusts() -> None:
    """By autoregressions of single outputs the yaw row had 0.7 of its deviation."""
    stated, at = [], [BASE.parameter_names.index(name) for name in YAW]
    for seed in range(8):
        rng = np.random.default_rng(seed)
        data = [
            Maneuver(
                DT_S, u, flown(u, wind(rng)[None])[0] + SENSORS * rng.standard_normal((ROWS, 5))
            )
            for u in INPUTS
        ]
        found = fit("output-error-white", BASE, data, multiple_starts=False)
        problem = output_problem(found.model, data)
        responses = problem.respond(found.estimate)
        assert responses is not None
        noise = noise_of_outputs(problem, responses, found.estimate)
        stated.append(np.diag(white_fit_covariance(problem, responses, noise))[at])
    assert responses is not None
    left = [problem.residual(k, r.y) for k, r in enumerate(responses)]
    weight = problem.counts / np.sum([np.sum(e**2, axis=1) for e in left], axis=0)
    slopes = [np.stack(list(r.sensitivities), axis=1) for r in responses]  # (samples, outputs, own)
    information = np.diag(problem.prior_precision)
    for k, J in enumerate(slopes):
        own = problem.columns(k)
        information[np.ix_(own, own)] += np.einsum("tja,j,tjb->ab", J, weight, J)
    inverse = np.linalg.inv(information)
    steps = np.zeros((150, len(inverse)))
    winds = [[wind(rng) for _ in slopes] for rng in np.random.default_rng(99).spawn(len(steps))]
    for k, J in enumerate(slopes):
        noise_alone = flown(np.zeros((ROWS, 2)), np.array([one[k] for one in winds]))
        steps[:, problem.columns(k)] += np.einsum("tja,j,ntj->na", J, weight, noise_alone)
    drawn = np.mean((steps @ inverse) ** 2, axis=0)[at]
    ratio = np.sqrt(np.mean(stated, axis=0) / drawn)
    np.testing.assert_allclose(ratio, 1.0, atol=0.25)
