"""What added columns explain of an output besides the parameters, in noise of any colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.models.uncertainty import covariance_root
from host.sysid.numerics.ar_noise import ArNoise, choose_order, fit_ar, lagged_moments
from host.sysid.numerics.information_inverse import (
    identified_inverse,
)

FEWEST_FREEDOM = 30.0  # of the noise along a column or a signature, for a test
RANK = 1e-9  # of the largest eigenvalue of the scaled columns: less is rounding


@dataclass(frozen=True)
class OutputData:
    """Residuals, sensitivities and added columns of one output, a list entry per maneuver."""

    residuals: Sequence[Array]  # (samples,)
    slopes: Sequence[Array]  # (samples, P)
    added: Sequence[Array]  # (samples, k)


@dataclass(frozen=True)
class FittedParameters:
    """The parameters in some noise: covariance, its root, and the score of the residual."""

    inverse: Array
    root: Array
    score: Array

    @classmethod
    def of(cls, total: Array, score: Array) -> FittedParameters:
        inverse = identified_inverse(total)
        return cls(inverse, covariance_root(inverse), score)


def whiten(data: OutputData, noise: ArNoise) -> OutputData:
    return OutputData(
        [noise.whiten(e[:, None])[:, 0] for e in data.residuals],
        [noise.whiten(J) for J in data.slopes],
        [noise.whiten(Z) for Z in data.added],
    )


def gram(blocks: Sequence[Array]) -> Array:
    return np.asarray(sum(b.T @ b for b in blocks))


def _cross(left: Sequence[Array], right: Sequence[Array]) -> Array:
    return np.asarray(sum(a.T @ b for a, b in zip(left, right, strict=True)))


def total_score(whitened: Sequence[OutputData], variance: Array) -> Array:
    parts = [_cross(w.slopes, w.residuals) / v for w, v in zip(whitened, variance, strict=True)]
    return np.asarray(sum(parts))


def reduced_normal(
    w: OutputData, variance: float, fitted: FittedParameters
) -> tuple[Array, Array, Array]:
    """Return information and score of the added columns, freed of the parameters; and the link."""
    link = fitted.inverse @ _cross(w.slopes, w.added) / variance
    inner = gram(w.added) / variance - _cross(w.added, w.slopes) @ link / variance
    right = _cross(w.added, w.residuals) / variance - link.T @ fitted.score
    return inner, right, link


def _scaled_eigen(inner: Array, w: OutputData, variance: float) -> tuple[Array, Array, Array]:
    """Return scale, eigenvalues and vectors of the columns that are not spoken for."""
    scale = np.sqrt(np.maximum(np.diag(gram(w.added)) / variance, 1e-300))
    value, vector = np.linalg.eigh(inner / np.outer(scale, scale))
    kept = value > RANK * np.max(value, initial=RANK)
    return scale, value[kept], vector[:, kept]


def added_power(
    data: OutputData,
    w: OutputData,
    noise: ArNoise,
    variance: float,
    reduced: tuple[Array, Array, Array],
) -> tuple[float, int, float]:
    """Return the power that the added columns explain, in units of noise, and both freedoms."""
    inner, right, link = reduced
    scale, value, vector = _scaled_eigen(inner, w, variance)
    root = (vector / np.sqrt(value)) / scale[:, None]
    directions = [(Z - J @ link) @ root for J, Z in zip(data.slopes, data.added, strict=True)]
    samples = sum(len(e) for e in data.residuals)
    known, log_variance = _known_directions(directions, noise, variance, samples)
    parts = known.T @ (root.T @ right)
    return float(parts @ parts), len(parts), max(2.0 / log_variance, 1.0)


def _known_directions(
    directions: Sequence[Array], noise: ArNoise, variance: float, samples: int
) -> tuple[Array, float]:
    """Return directions along which the noise's power is known, and the variance of its logarithm.

    The degrees of freedom of a power are 2 / var(log power) (Satterthwaite, Biometrics Bulletin 2,
    1946). The innovation variance has 2 / samples. The AR coefficients have the asymptotic
    covariance R^-1 / samples; with coefficient k the power of a direction x, w when whitened, moves
    by -2 sum w[t] x[t - k]. Slow noise is known to few degrees of freedom along slow directions:
    those below `FEWEST_FREEDOM` are left out, for they determine nothing.

    Parameters
    ----------
    directions : sequence of Array, shape (samples, k)
        Directions of each maneuver; orthonormal when whitened, in units of noise.
    noise : ArNoise
    variance : float
        Variance of the innovations.
    samples : int

    Returns
    -------
    Array, shape (k, known)
    float
    """
    count, order = directions[0].shape[1], noise.order
    if order == 0:
        return np.eye(count), 2.0 / samples
    slopes = np.zeros((order, count, count))
    for x in directions:
        w = noise.whiten(x)[order:] / variance
        for k in range(1, order + 1):
            slopes[k - 1] -= w.T @ x[order - k : len(x) - k]
    slopes += np.swapaxes(slopes, 1, 2)
    rooted = np.einsum("ab,bij->aij", noise.start_whitener, slopes)  # R^-1 = root' root
    value, vector = np.linalg.eigh(np.einsum("aij,ajk->ik", rooted, rooted) / samples)
    kept = value + 2.0 / samples <= 2.0 / FEWEST_FREEDOM
    # The errors of all directions are one: those of a few AR coefficients.
    mean = float(np.mean(value[kept])) if kept.any() else 0.0
    return vector[:, kept], 2.0 / samples + mean


def noise_model(
    data: OutputData,
    w: OutputData,
    variance: float,
    fitted: FittedParameters,
    highest: int,
    *,
    with_added: bool,
) -> tuple[ArNoise, float]:
    """Return the AR model of an output's noise and its innovation variance.

    `with_added` says whether the added columns take their share first.
    """
    own = fitted.inverse @ fitted.score
    added: Array = np.zeros(data.added[0].shape[1])
    root: Array = np.zeros((len(added), 0))
    link: Array = np.zeros((len(own), len(added)))
    if with_added:
        inner, right, link = reduced_normal(w, variance, fitted)
        scale, kept, directions = _scaled_eigen(inner, w, variance)
        root = (directions / np.sqrt(kept)) / scale[:, None]  # of the added columns' covariance
        added = root @ (root.T @ right)
        own = own - link @ added
    residuals, shares = [], []
    for e, J, Z in zip(data.residuals, data.slopes, data.added, strict=True):
        residuals.append(e - J @ own - Z @ added)
        shares.append(np.hstack([J @ fitted.root, (Z - J @ link) @ root]))
    moments = lagged_moments(residuals, shares, highest)
    count = sum(len(e) for e in residuals) - highest * len(residuals)
    order = choose_order(moments, count)
    coefficient, innovation = fit_ar(moments[: order + 1, : order + 1], order)
    return ArNoise.from_coefficient(coefficient), max(innovation / count, 1e-300)
