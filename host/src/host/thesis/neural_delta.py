"""Neural delta method: derivatives from a trained network by finite perturbation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import optimize

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators import fit_equation_error, regression_equations
from host.sysid.estimators.regression import RegressionEquation
from host.sysid.models import FitResult, LinearModel, Maneuver

NEURONS = 6
DECAY_LEAST = 1e-3
# Decay of weights over the share of the dependent variable that a plane does not explain: an error
# of 10 % in place of 67 %.
DECAY_PER_NOISE = 0.5
STEP = 0.5  # perturbation in standard deviations of the input
BLOCKS = 20


def fit_neural(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    neurons: int = NEURONS,
    repeats: int = 8,
    seed: int = 1,
    bandwidth: float | None = None,
) -> FitResult:
    """Fit by the neural delta method.

    A small network learns state rates (and accelerations) from states and inputs. Each input is
    then perturbed up and down at every sample; the mean central difference is the derivative
    (Raisinghani, Ghosh & Kalra, Aeronautical Journal 102, 1998). Its scatter over samples measures
    how linear the network is, not how certain the derivative is. The covariance comes from repeated
    training on resampled blocks.

    Parameters
    ----------
    model, maneuvers
        Model and data; every state must be measured, entries must not be tied.
    neurons : int
        Hidden units per equation.
    repeats : int
        Trainings on resampled blocks, at least 3; their scatter is the covariance.
    seed : int
        Seed of start weights and resampling.
    bandwidth : float, optional
        Bandwidth of the differentiation, Hz.
    """
    if repeats < 3:
        raise IdentificationError(f"{repeats} trainings tell no scatter, at least 3 are needed")
    names, equations = regression_equations(model, maneuvers, bandwidth=bandwidth)
    theta = np.zeros(len(names))
    scatter = np.zeros((repeats, len(names)))
    rng = np.random.default_rng(seed)
    for equation in sorted({block.equation for block in equations}):
        own: list[RegressionEquation] = [block for block in equations if block.equation == equation]
        X = np.vstack([block.regressors for block in own])
        y = np.concatenate([block.dependent for block in own])
        active = np.flatnonzero(X.std(axis=0) > 0.0)
        if theta[active].any():
            raise IdentificationError(
                "the neural delta method takes one equation at a time, and this"
                " model ties entries of several: use equation-error-weighted"
            )
        theta[active] = _derivatives(X[:, active], y, neurons, rng)
        edges = np.array_split(np.arange(len(y)), BLOCKS)
        for k in range(repeats):
            picked = np.concatenate([edges[i] for i in rng.integers(0, BLOCKS, BLOCKS)])
            scatter[k, active] = _derivatives(X[picked][:, active], y[picked], neurons, rng)
    covariance = np.cov(scatter.T) + 1e-300 * np.eye(len(names))
    batch = fit_equation_error(model, maneuvers, bandwidth=bandwidth)
    residuals = tuple(
        np.column_stack([r.residual(theta) for r in equations if r.maneuver == number])
        for number in range(len(maneuvers))
    )
    return FitResult(
        method="neural delta method",
        model=model,
        names=names,
        estimate=theta,
        covariance=covariance,
        covariance_white=covariance,
        degrees_of_freedom=np.full(len(names), float(repeats - 1)),
        residuals=residuals,
        fitted=batch.fitted,
        residual_kind="rate",
        noise_covariance=batch.noise_covariance,
        iterations=repeats + 1,
        converged=True,
    )


def _derivatives(X: Array, y: Array, neurons: int, rng: np.random.Generator) -> Array:
    """Train one network and return mean central differences by each column of X."""
    mean, spread = X.mean(axis=0), X.std(axis=0)
    spread = np.where(spread > 0.0, spread, 1.0)
    centre, size = float(y.mean()), float(y.std()) or 1.0
    z, t = (X - mean) / spread, (y - centre) / size
    n = z.shape[1]
    linear_fit = np.linalg.lstsq(z, t, rcond=None)[0]
    decay = DECAY_LEAST + DECAY_PER_NOISE * float(np.mean((t - z @ linear_fit) ** 2))
    start = 0.3 * rng.standard_normal(neurons * (n + 2) + 1)

    def unpack(w: Array) -> tuple[Array, Array, Array, float]:
        inner = w[: neurons * n].reshape(n, neurons)
        offset = w[neurons * n : neurons * (n + 1)]
        outer = w[neurons * (n + 1) : -1]
        return inner, offset, outer, float(w[-1])

    def loss(w: Array) -> tuple[float, Array]:
        inner, offset, outer, last = unpack(w)
        h = np.tanh(z @ inner + offset)
        residual = h @ outer + last - t
        back = (residual[:, None] * outer) * (1.0 - h**2) / len(t)
        gradient = np.concatenate(
            [(z.T @ back).ravel(), back.sum(axis=0), h.T @ residual / len(t), [residual.mean()]]
        )
        return 0.5 * float(np.mean(residual**2)) + 0.5 * decay * float(w @ w) / len(w), (
            gradient + decay * w / len(w)
        )

    found = optimize.minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": 400})
    inner, offset, outer, _ = unpack(found.x)
    result = np.zeros(n)
    for k in range(n):
        shift = np.zeros(n)
        shift[k] = STEP
        up = np.tanh((z + shift) @ inner + offset) @ outer
        down = np.tanh((z - shift) @ inner + offset) @ outer
        result[k] = float(np.mean(up - down)) / (2.0 * STEP)
    return result * size / spread
