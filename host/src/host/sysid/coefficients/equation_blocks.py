"""One equation in one window: its regressors over the unknowns that enter it; normal equations.

Forty maneuvers have two hundred blocks; each contains the terms of its equation and the sensor
errors. The normal equations are sums over blocks, so the matrix with a line for every frequency of
a flight is never formed. Each block has a constant and a slope in time of its own, which are
projected out: the same result as estimating them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.coefficients.window_spectra import (
    ROUNDING_SHARE,
    EquationKey,
    WindowTransform,
    equation_weight,
    trend_count,
)
from host.sysid.reconstruction.inverse_sensor_model import Spectrum


@dataclass(frozen=True, slots=True)
class Unknowns:
    """The vector of unknowns: coefficients of every equation, then sensor errors.

    Attributes
    ----------
    positions : mapping
        Equation to the indices of its coefficients.
    coefficients, errors : int
        Number of each kind, in this order in the vector.
    """

    positions: Mapping[str, IntArray]
    coefficients: int
    errors: int

    @property
    def count(self) -> int:
        """Number of all unknowns."""
        return self.coefficients + self.errors


@dataclass(frozen=True, slots=True)
class EquationSpectra:
    """Spectra of the equations by equation and window, each (F, k).

    Attributes
    ----------
    spectra : mapping
        Response in column 0, regressors behind it.
    slopes : mapping
        Derivative of the residual by each sensor error; empty as long as they are not estimated.
    """

    spectra: Mapping[EquationKey, Spectrum]
    slopes: Mapping[EquationKey, Spectrum]


@dataclass(frozen=True, slots=True)
class EquationBlock:
    """One equation in one window; real parts of all frequencies, then imaginary parts, weighted.

    Attributes
    ----------
    equation : str
    window : int
    unknown_indices : IntArray, shape (k,)
        The unknowns that belong to the columns of `A` and `Z`.
    A : Array, shape (2 F, k)
        Regressors.
    Z : Array, shape (2 F, k)
        Instrumental variables: the regressors of the gust-free simulation.
    y : Array, shape (2 F,)
        Residual before the step.
    trend_basis : Array, shape (2 F, lines)
        Orthonormal basis of constant and slope in time.
    """

    equation: str
    window: int
    unknown_indices: IntArray
    A: Array
    Z: Array
    y: Array
    trend_basis: Array

    def without_trend(self, values: Array) -> Array:
        """Return values, (2 F,) or (2 F, k), with constant and slope in time projected out."""
        return values - self.trend_basis @ (self.trend_basis.T @ values)

    def residual_after(self, step: Array) -> Array:
        """Return the residual after a step of all unknowns, trend removed."""
        return self.without_trend(self.y - self.A @ step[self.unknown_indices])


@dataclass(frozen=True, slots=True)
class NormalEquations:
    """Normal equations of instrumental variables (Ljung, System Identification, sec. 7.6).

    Attributes
    ----------
    matrix : Array, shape (n, n)
        Z' A.
    score_covariance : Array, shape (n, n)
        Z' Z: covariance of the score for residuals of unit variance (White 1982).
    right_side : Array, shape (n,)
        Z' y.
    diagonal : Array, shape (n,)
        Diagonal of Z' A before the trends are projected out. A regressor that is constant in
        every window is recognised by it.
    """

    matrix: Array
    score_covariance: Array
    right_side: Array
    diagonal: Array


def equation_blocks(
    windows: Sequence[WindowTransform],
    measured: EquationSpectra,
    noise_free: EquationSpectra,
    coefficients: Mapping[str, Array],
    unknowns: Unknowns,
    noise: Mapping[str, tuple[Array, Array]],
) -> list[EquationBlock]:
    """Return the weighted block of every equation of every window.

    Parameters
    ----------
    windows : sequence of WindowTransform
    measured : EquationSpectra
        Spectra of the flight; they give regressors and residuals.
    noise_free : EquationSpectra
        Spectra of the gust-free simulation; they give the instrumental variables.
    coefficients : mapping
        Estimate so far, by equation.
    unknowns : Unknowns
    noise : mapping
        Frequency (Hz) and spectrum of the residuals by equation; an equation without has weight
        one at every frequency.
    """
    found = []
    errors = np.arange(unknowns.coefficients, unknowns.count)
    for number, window in enumerate(windows):
        for name in window.equations:
            key = name, number
            weight = equation_weight(window.frequency_hz, noise.get(name))
            indices = [unknowns.positions[name]]
            if measured.slopes:
                indices.append(errors)
            A, Z = (_real(_columns(side, key) * weight[:, None]) for side in (measured, noise_free))
            spectrum = measured.spectra[key]
            residual = spectrum[:, 0] - spectrum[:, 1:] @ coefficients[name]
            trend = _real(window.trends[:, : trend_count(name)] * weight[:, None])
            found.append(
                EquationBlock(
                    name,
                    number,
                    np.concatenate(indices),
                    A,
                    Z,
                    _real(residual * weight),
                    _orthonormal(trend),
                )
            )
    return found


def _columns(side: EquationSpectra, key: EquationKey) -> Spectrum:
    """Return the regressors of one block, (F, k): terms, sensor errors."""
    parts = [side.spectra[key][:, 1:]]
    if side.slopes:
        parts.append(-side.slopes[key])
    return np.hstack(parts)


def _real(values: Spectrum) -> Array:
    return np.concatenate([values.real, values.imag])


def _orthonormal(columns: Array) -> Array:
    """Return orthonormal columns of the same span, (2 F, k); columns of rounding are dropped."""
    sizes = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    kept = sizes > ROUNDING_SHARE * np.max(sizes)
    return np.linalg.qr(columns[:, kept] / sizes[kept])[0]


def accumulate(blocks: Sequence[EquationBlock], count: int) -> NormalEquations:
    """Return the sum of the normal equations of some blocks over all `count` unknowns."""
    matrix, score_covariance = np.zeros((count, count)), np.zeros((count, count))
    right_side, diagonal = np.zeros(count), np.zeros(count)
    for block in blocks:
        at = np.ix_(block.unknown_indices, block.unknown_indices)
        Z = block.without_trend(block.Z)
        matrix[at] += Z.T @ block.A
        score_covariance[at] += Z.T @ Z
        right_side[block.unknown_indices] += Z.T @ block.y
        diagonal[block.unknown_indices] += np.einsum("ij,ij->j", block.Z, block.A)
    return NormalEquations(matrix, score_covariance, right_side, diagonal)
