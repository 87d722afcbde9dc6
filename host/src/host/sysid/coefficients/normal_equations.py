"""The Gauss-Newton step of the search: normal equations with prior, consider covariance.

Coefficients and sensor errors are estimated; some sensor errors are only considered: they are not
estimated, and their covariance is added to that of the estimate (Schmidt; Tapley, Schutz & Born,
Statistical Orbit Determination, ch. 6).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.errors import IdentificationError
from host.sysid.coefficients.equation_blocks import NormalEquations
from host.sysid.models.uncertainty import consider_covariance

# Growth of the variance of a regressor that is constant or equal to others.
UNDETERMINED = 1e12
ROUNDING = 1e-30  # a sum of squares below it is rounding


@dataclass(frozen=True, slots=True)
class Prior:
    """Prior of the unknowns: information and its right-hand side.

    Attributes
    ----------
    information : Array, shape (n, n)
        Inverse covariance.
    gradient : Array, shape (n,)
        Right-hand side that it adds to the normal equations.
    """

    information: Array
    gradient: Array


@dataclass(frozen=True, slots=True)
class GaussNewtonStep:
    """The solution of the normal equations.

    Attributes
    ----------
    step : Array, shape (n,)
    covariance : Array, shape (n, n)
        Covariance of the estimate after the step, consider parameters included.
    normal_matrix, right_side : Array, shapes (n, n) and (n,)
        ``normal_matrix @ step = right_side``, prior included.
    inverse : Array, shape (n, n)
        Inverse of the normal matrix.
    """

    step: Array
    covariance: Array
    normal_matrix: Array
    right_side: Array
    inverse: Array


def solve_normal_equations(
    equations: NormalEquations,
    prior: Prior,
    position: Mapping[str, int],
    considered: IntArray,
    sd: Array,
) -> GaussNewtonStep:
    """Solve the normal equations for one step.

    Parameters
    ----------
    equations : NormalEquations
        Z' A, Z' Z and Z' y of all blocks.
    prior : Prior
    position : mapping
        Index of each coefficient among the unknowns, by name.
    considered : IntArray, shape (k,)
        Unknowns that are not estimated but considered in the covariance.
    sd : Array, shape (k,)
        Their standard deviations.

    Returns
    -------
    GaussNewtonStep

    Raises
    ------
    IdentificationError
        If a coefficient cannot be determined at all.
    """
    normal_matrix = equations.matrix + prior.information
    right_side = equations.right_side + prior.gradient
    diagonal = equations.diagonal + np.diag(prior.information)
    scale = 1.0 / np.sqrt(np.maximum(np.abs(diagonal), ROUNDING))
    both = np.outer(scale, scale)
    constant = diagonal * scale**2 < 0.5
    inverse = invert_normal_matrix(normal_matrix * both, constant, position) * both
    # Sensitivity of the estimate to the consider parameters (EQUATIONS.md, eq. 35).
    consider_sensitivity = -inverse @ equations.matrix[:, considered]
    consider_sensitivity[considered] = np.eye(len(considered))
    # Sandwich with the instrumental variables Z (EQUATIONS.md, eq. 18).
    covariance = inverse @ (equations.score_covariance + prior.information) @ inverse.T
    covariance += consider_covariance((consider_sensitivity * sd).T)
    return GaussNewtonStep(inverse @ right_side, covariance, normal_matrix, right_side, inverse)


def invert_normal_matrix(scaled: Array, constant: BoolArray, position: Mapping[str, int]) -> Array:
    """Invert the scaled normal matrix.

    Parameters
    ----------
    scaled : Array, shape (n, n)
    constant : BoolArray, shape (n,)
        Columns whose regressor is constant in every window.
    position : mapping
        Index of each coefficient, by name.

    Raises
    ------
    IdentificationError
        If it is singular for a coefficient; the message names the undeterminable terms.
    """
    try:
        found = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        found = np.linalg.pinv(scaled, rcond=1e-13) + np.diag(constant) * 2.0 * UNDETERMINED
    lost = [n for n, k in position.items() if not abs(found[k, k]) < UNDETERMINED]
    if lost:
        raise IdentificationError(
            f"the flight cannot tell {', '.join(lost)}: what they go with never moves, or is the"
            " same as other terms; leave them out"
        )
    return found
