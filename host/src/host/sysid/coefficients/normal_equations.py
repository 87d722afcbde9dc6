"""One step of the search: normal equations and what is known before, to unknowns and covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.sysid.coefficients.equation_blocks import Sums
from host.sysid.identification_error import IdentificationError
from host.sysid.models.consider_covariance import consider_covariance

LOST = 1e12  # by which a variance grows where a regressor never moves, or is the same as others
STILL = 1e-30  # a sum of squares below it is rounding


@dataclass(frozen=True, slots=True)
class Known:
    """What is known before the flight: inverse covariance (n, n), its pull on the step (n,)."""

    information: Array
    pull: Array


@dataclass(frozen=True, slots=True)
class Step:
    """The step (n,) with its covariance; `normal` step = `right`, what is known before included."""

    step: Array
    covariance: Array
    normal: Array
    right: Array
    inverse: Array


def stepped(
    sums: Sums, known: Known, position: Mapping[str, int], considered: IntArray, sd: Array
) -> Step:
    """Solve the normal equations.

    Parameters
    ----------
    sums : Sums
    known : Known
    position : mapping
        Where coefficients stand, by name.
    considered : (k,) IntArray
        Unknowns that are not estimated but carried into the covariance (Schmidt).
    sd : (k,) Array
        Their standard deviations.

    Raises
    ------
    IdentificationError
        If a coefficient cannot be told at all.
    """
    normal, right = sums.normal + known.information, sums.right + known.pull
    sizes = sums.sizes + np.diag(known.information)
    scale = 1.0 / np.sqrt(np.maximum(np.abs(sizes), STILL))
    both = np.outer(scale, scale)
    inverse = told_inverse(normal * both, sizes * scale**2 < 0.5, position) * both
    drawn = -inverse @ sums.normal[:, considered]
    drawn[considered] = np.eye(len(considered))
    covariance = inverse @ (sums.meat + known.information) @ inverse.T
    covariance += consider_covariance((drawn * sd).T)
    return Step(inverse @ right, covariance, normal, right, inverse)


def told_inverse(normal: Array, still: BoolArray, position: Mapping[str, int]) -> Array:
    """Return the inverse of a scaled matrix; name the terms if it has none.

    `still` says of each column whether it never moves, (n,).
    """
    try:
        found = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        found = np.linalg.pinv(normal, rcond=1e-13) + np.diag(still) * 2.0 * LOST
    lost = [n for n, k in position.items() if not abs(found[k, k]) < LOST]
    if lost:
        raise IdentificationError(
            f"the flight cannot tell {', '.join(lost)}: what they go with never moves, or is the"
            " same as other terms; leave them out"
        )
    return found
