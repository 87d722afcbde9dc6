"""Test whether repeated maneuvers agree, and say by how much their joint estimate is open if not.

The influence of maneuver i on the joint estimate is d_i = P g_i, with P the inverse information and
g_i the score of the maneuver alone (Belsley, Kuh & Welsch, Regression Diagnostics, 1980). All d_i
sum to zero. If the covariance is right, the sum of d_i^2 estimates variance times 1 - sum w_i^2,
with w_i the maneuver's share of the information. Where a chi-square test rejects that at 1 %, the
deviation grows by the Birge ratio (Birge, Physical Review 40, 1932) and the interval gets a t
quantile for as many maneuvers (`models/uncertainty.py`). A covariance never becomes smaller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import special

from host.constants import SIGNIFICANCE
from host.sysid.models.uncertainty import ModelError, Uncertainty

if TYPE_CHECKING:
    from host.arrays import Array

MIN_EFFECTIVE_MANEUVERS = 1.5  # effective number that inform a parameter, for a test


@dataclass(frozen=True)
class ManeuverAgreement:
    """Scatter of maneuvers about the joint estimate, per common parameter.

    Attributes
    ----------
    names : tuple of str
    maneuvers : Array, shape (P,)
        Effective number that inform the parameter; chi-square has one degree of freedom less.
    chi_square, p_value : Array, shape (P,)
        NaN where fewer than `MIN_EFFECTIVE_MANEUVERS` inform it.
    factor : Array, shape (P,)
        Birge ratio by which the standard error grows, 1 where the maneuvers agree.
    variance : Array, shape (P,)
        Variance that the scatter was tested against.
    """

    names: tuple[str, ...]
    maneuvers: Array
    chi_square: Array
    p_value: Array
    factor: Array
    variance: Array

    @property
    def in_normal_quantiles(self) -> ModelError:
        """What the scatter says that a model lacks, where every interval is a normal one.

        Part of the variance may have causes that are the same in all maneuvers: it grows by what
        the tested part lacks.
        """
        inflated = self.factor > 1.0
        freedom = np.where(inflated, np.maximum(self.maneuvers - 1.0, 1.0), np.inf)
        quantile_ratio = special.stdtrit(freedom, 0.975) / special.ndtri(0.975)
        more = ((self.factor * quantile_ratio) ** 2 - 1.0) * self.variance
        return ModelError(variance=np.where(inflated, more, 0.0))


def maneuver_influence(
    information: Sequence[Array], scores: Sequence[Array], inverse: Array
) -> dict[str, float | Array]:
    """Return influence and information share of every maneuver, for `FitResult.details`.

    Parameters
    ----------
    information, scores : sequence of Array
        Per maneuver, (P, P) and (P,), without the prior.
    inverse : Array, shape (P, P)
        Inverse of the whole information, prior included.
    """
    return {
        "maneuver_influence": np.array([inverse @ g for g in scores]),
        "information_share": np.array(
            [np.einsum("kj,jk->k", inverse, part) for part in information]
        ),
    }


def maneuver_agreement(names: tuple[str, ...], known: Uncertainty) -> ManeuverAgreement | None:
    """Return the scatter of the maneuvers of a joint fit; None if the method gives no influence.

    Parameters
    ----------
    names : tuple of str
        Common parameters, which come first.
    known : Uncertainty
        Its details have the influence; noise alone is in its covariance.
    """
    influence, information_share = (
        known.details.get("maneuver_influence"),
        known.details.get("information_share"),
    )
    count = len(names)
    if (
        not isinstance(influence, np.ndarray)
        or not isinstance(information_share, np.ndarray)
        or len(influence) < 2
    ):
        return None
    return scatter_test(
        names, influence[:, :count], information_share[:, :count], known.variance[:count]
    )


def scatter_test(
    names: tuple[str, ...], influence: Array, information_share: Array, variance: Array
) -> ManeuverAgreement:
    """Test the scatter of maneuvers about their joint estimate against its variance.

    Parameters
    ----------
    names : tuple of str
    influence, information_share : Array, shape (maneuvers, P)
        Influence of each maneuver on the estimate, and its share of the information.
    variance : Array, shape (P,)
        Variance of the estimate, as far as its causes differ between maneuvers.
    """
    total = np.maximum(np.sum(information_share, axis=0), 1e-12)
    weight = np.clip(information_share / total, 0.0, 1.0)
    squares = np.sum(weight**2, axis=0)
    number = 1.0 / np.maximum(squares, 1e-12)
    deviation = influence - weight * np.sum(influence, axis=0)
    scatter = np.sum(deviation**2, axis=0) / np.maximum(1.0 - squares, 1e-12)
    testable = (number >= MIN_EFFECTIVE_MANEUVERS) & (variance > 0.0)
    ratio = np.where(testable, scatter / np.where(testable, variance, 1.0), np.nan)
    chi_square = (number - 1.0) * ratio
    p_value = np.full(len(names), np.nan)
    p_value[testable] = special.chdtrc(number[testable] - 1.0, chi_square[testable])
    inflated = testable & (np.nan_to_num(p_value, nan=1.0) < SIGNIFICANCE)
    return ManeuverAgreement(
        names=names,
        maneuvers=number,
        chi_square=chi_square,
        p_value=p_value,
        factor=np.where(inflated, np.sqrt(np.where(inflated, ratio, 1.0)), 1.0),
        variance=variance,
    )


def disagreement(found: ManeuverAgreement | None) -> ModelError | None:
    """Return what the scatter says that a model lacks, and a line for each parameter."""
    if found is None or not np.any(found.factor > 1.0):
        return None
    inflated = found.factor > 1.0
    warnings = (
        f"maneuvers disagree on {found.names[k]} by {found.factor[k]:.1f} times its interval, which"
        " is widened by that"
        for k in np.flatnonzero(inflated)
    )
    freedom = np.where(inflated, found.maneuvers - 1.0, np.inf)
    return ModelError(factor=found.factor, freedom=freedom, warnings=tuple(warnings))
