"""Theil's inequality coefficient and what it is made of.

U = rms(z - y) / (rms(z) + rms(y)) is 0 for perfect agreement and at most 1. The mean square error
is the sum of three parts: bias, (mean z - mean y)^2, a constant offset; variance, (sd z - sd y)^2,
motion of another size; covariance, 2 (1 - rho) sd z sd y, what moves at another time, noise
included (EQUATIONS.md, eq. 37; Theil, Economic Forecasts and Policy, 1961).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array


@dataclass(frozen=True, slots=True)
class TheilInequality:
    """The coefficient of one signal; its parts are shares of the mean square error, sum 1."""

    name: str
    coefficient: float
    bias: float
    variance: float
    covariance: float


def theil_inequality(
    names: Sequence[str], measured: Sequence[Array], simulated: Sequence[Array]
) -> tuple[TheilInequality, ...]:
    """Return Theil's coefficient of every signal, maneuvers pooled.

    Parameters
    ----------
    names : sequence of str
        One per column.
    measured, simulated : sequence of Array
        Per maneuver (samples, columns), in the same units.

    Returns
    -------
    tuple of TheilInequality
        NaN where nothing was simulated, or parts of an error of zero.
    """
    z, y = np.concatenate(list(measured)), np.concatenate(list(simulated))
    found = []
    for k, name in enumerate(names):
        a, b = z[:, k], y[:, k]
        square = float(np.mean((a - b) ** 2))
        size = float(np.sqrt(np.mean(a**2)) + np.sqrt(np.mean(b**2)))
        with np.errstate(invalid="ignore", divide="ignore"):
            over = np.float64(1.0) / np.float64(square)
            bias = float((a.mean() - b.mean()) ** 2 * over)
            variance = float((a.std() - b.std()) ** 2 * over)
            product = np.mean((a - a.mean()) * (b - b.mean()))
            covariance = float(2.0 * (a.std() * b.std() - product) * over)
        coefficient = float(np.sqrt(square)) / max(size, 1e-300)
        found.append(TheilInequality(name, coefficient, bias, variance, covariance))
    return tuple(found)
