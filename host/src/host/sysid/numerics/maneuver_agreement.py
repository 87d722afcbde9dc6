"""Do repeated maneuvers agree? Their scatter against the intervals, widened where it does not fit.

Each maneuver pulls the joint answer by d_i = P g_i (P the inverse information, g_i its own score);
the pulls sum to zero. If the intervals are right, sum d_i^2 estimates variance times 1 - sum w_i^2,
with w_i the maneuver's share of the information. Where chi-square says with 99 % that the scatter
is larger, the interval is widened to it (Birge, Phys. Rev. 40 (1932)), with a t quantile for as
many maneuvers. Nothing is ever narrowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from host.arrays import Array
from host.sysid.models.fit_result import FitResult

SIGNIFICANCE = 0.01
MIN_EFFECTIVE_MANEUVERS = 1.5  # effective number of maneuvers that tell something of a parameter


@dataclass(frozen=True)
class ManeuverAgreement:
    """Scatter of maneuvers about the joint answer, per common parameter.

    Attributes
    ----------
    names : tuple of str
    maneuvers : Array, shape (P,)
        Effective number that tell of the parameter; chi-square has one degree of freedom less.
    chi_square, p_value : Array, shape (P,)
        NaN where fewer than `MIN_EFFECTIVE_MANEUVERS` tell of it.
    factor : Array, shape (P,)
        By which the interval was widened, 1 where the maneuvers agree.
    variance : Array, shape (P,)
        Against which they were judged.
    """

    names: tuple[str, ...]
    maneuvers: Array
    chi_square: Array
    p_value: Array
    factor: Array
    variance: Array

    @property
    def extra_variance(self) -> Array:
        """What the scatter adds to a variance of normal quantiles, (P,): 0 where it is fair."""
        wide = self.factor > 1.0
        freedom = np.where(wide, np.maximum(self.maneuvers - 1.0, 1.0), np.inf)
        stretch = special.stdtrit(freedom, 0.975) / special.ndtri(0.975)
        return np.where(wide, ((self.factor * stretch) ** 2 - 1.0) * self.variance, 0.0)


def maneuver_influence(
    information: Sequence[Array], scores: Sequence[Array], inverse: Array
) -> dict[str, float | Array]:
    """Return what `maneuver_agreement` needs of a fit, for `FitResult.details`.

    Parameters
    ----------
    information, scores : sequence of Array
        Per maneuver, (P, P) and (P,), prior left out.
    inverse : Array, shape (P, P)
        Of the whole information, prior included.
    """
    return {
        "maneuver_influence": np.array([inverse @ g for g in scores]),
        "information_share": np.array(
            [np.einsum("kj,jk->k", inverse, part) for part in information]
        ),
    }


def maneuver_agreement(result: FitResult) -> ManeuverAgreement | None:
    """Return the scatter of the maneuvers of a joint fit; None if the method does not tell it."""
    pull, share = result.details.get("maneuver_influence"), result.details.get("information_share")
    count = len(result.model.parameter_names)
    if not isinstance(pull, np.ndarray) or not isinstance(share, np.ndarray) or len(pull) < 2:
        return None
    variance = np.diag(result.covariance)[:count]
    return agreement_of(result.names[:count], pull[:, :count], share[:, :count], variance)


def agreement_of(
    names: tuple[str, ...], pull: Array, share: Array, variance: Array
) -> ManeuverAgreement:
    """Return how maneuvers scatter about their joint answer against its variance.

    Parameters
    ----------
    names : tuple of str
    pull, share : Array, shape (maneuvers, P)
        How far each maneuver pulls the answer, and its share of what is known of it.
    variance : Array, shape (P,)
        Of the answer, as far as it comes from what differs between maneuvers.
    """
    total = np.maximum(np.sum(share, axis=0), 1e-12)
    weight = np.clip(share / total, 0.0, 1.0)
    squares = np.sum(weight**2, axis=0)
    number = 1.0 / np.maximum(squares, 1e-12)
    own = pull - weight * np.sum(pull, axis=0)
    spread = np.sum(own**2, axis=0) / np.maximum(1.0 - squares, 1e-12)
    testable = (number >= MIN_EFFECTIVE_MANEUVERS) & (variance > 0.0)
    ratio = np.where(testable, spread / np.where(testable, variance, 1.0), np.nan)
    chi_square = (number - 1.0) * ratio
    p_value = np.full(len(names), np.nan)
    p_value[testable] = special.chdtrc(number[testable] - 1.0, chi_square[testable])
    wide = testable & (np.nan_to_num(p_value, nan=1.0) < SIGNIFICANCE)
    return ManeuverAgreement(
        names=names,
        maneuvers=number,
        chi_square=chi_square,
        p_value=p_value,
        factor=np.where(wide, np.sqrt(np.where(wide, ratio, 1.0)), 1.0),
        variance=variance,
    )


def inflate_covariance(result: FitResult, found: ManeuverAgreement | None) -> FitResult:
    """Return the result with intervals as wide as its maneuvers scatter, and a warning for each."""
    if found is None or not np.any(found.factor > 1.0):
        return result
    factor = np.ones(len(result.names))
    factor[: len(found.factor)] = found.factor
    said = tuple(
        f"maneuvers do not agree on {name}: they scatter {found.factor[k]:.1f} times its interval"
        f" (chi-square {found.chi_square[k]:.1f} on {found.maneuvers[k] - 1.0:.1f}), widened to it"
        for k, name in enumerate(found.names)
        if found.factor[k] > 1.0
    )
    freedom = result.degrees_of_freedom.copy()
    wide = np.flatnonzero(found.factor > 1.0)
    freedom[wide] = np.minimum(freedom[wide], np.maximum(found.maneuvers[wide] - 1.0, 1.0))
    return replace(
        result,
        covariance=result.covariance * np.outer(factor, factor),
        degrees_of_freedom=freedom,
        warnings=(*result.warnings, *said),
    )
