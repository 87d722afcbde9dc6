"""Profile of the likelihood over the delay of servos."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from host.errors import IdentificationError
from host.instrument.servo_prior import ServoPrior
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.ar_noise import HIGHEST_ORDER, fit_ar, lagged_moments
from host.sysid.numerics.input_coherence import block_length, block_means

LEAST, MOST = (-0.15, 0.3, 0.2), (0.5, 60.0, 60.0)  # a delay, a bandwidth, a rate that can be
SCAN_S = np.arange(-0.08, 0.241, 0.04)
# Noise of output error is fitted to means over the first, in s. The second is what a model lacks
# at any frequency, over the motion: else small errors of a model in calm air tell the delay.
AR_STEP_S, LACK = 0.02, 0.02
# The third argument is a fit behind servos not far from these, to start from, or None.
Fit = Callable[[LinearModel, Sequence[Maneuver], FitResult | None], FitResult]
Behind = Callable[[tuple[float, float, float]], Sequence[Maneuver]]


@dataclass
class DelayProfile:
    """Fits of a model behind servos of several delays, and what each costs."""

    model: LinearModel
    behind: Behind
    prior: ServoPrior
    fit: Fit

    def __post_init__(self) -> None:
        self.fits: dict[float, FitResult] = {}
        self.costs: dict[float, float] = {}

    def ask(self, delays_s: Sequence[float]) -> None:
        """Fit at some delays; one at which the fit fails is left out."""
        for delay_s in (round(float(d), 5) for d in delays_s):
            if delay_s in self.fits or not LEAST[0] <= delay_s <= MOST[0]:
                continue
            near = min(self.fits, key=lambda known: abs(known - delay_s), default=None)
            start = None if near is None else self.fits[near]
            data = self.behind((delay_s, *self.prior.mean[1:]))
            try:
                found = self.fit(self.model, data, start)
            except IdentificationError:
                continue
            self.fits[delay_s] = found
            far = (delay_s - self.prior.mean[0]) / self.prior.sd[0]
            self.costs[delay_s] = _cost(found, data) + 0.5 * far**2

    @property
    def best(self) -> float:
        """The delay that costs least."""
        if not self.costs:
            raise IdentificationError("no delay at which the fit comes about")
        return min(self.costs, key=self.costs.__getitem__)

    @property
    def hollows(self) -> list[float]:
        """The delays tried that cost less than both neighbours."""
        at = sorted(self.costs)
        costs = [np.inf, *(self.costs[d] for d in at), np.inf]
        return [d for k, d in enumerate(at) if costs[k + 1] < min(costs[k], costs[k + 2])]


class CoarseDelays:
    """Delays far apart by a method that looks for where to begin; searched once, when asked.

    Parameters
    ----------
    model : LinearModel
    behind : callable
        Maneuvers with the surfaces behind servos of these numbers.
    prior : ServoPrior
    quick : callable
        The method.
    """

    def __init__(self, model: LinearModel, behind: Behind, prior: ServoPrior, quick: Fit) -> None:
        self._profile = DelayProfile(model, behind, prior, quick)

    @cached_property
    def _asked(self) -> DelayProfile:
        outwards = sorted(SCAN_S.tolist(), key=lambda d: abs(d - self._profile.prior.mean[0]))
        self._profile.ask(outwards)
        return self._profile

    @property
    def best(self) -> float:
        """The delay that costs least."""
        return self._asked.best

    @property
    def hollows(self) -> list[float]:
        """The delays that cost less than both neighbours."""
        return self._asked.hollows


def _cost(found: FitResult, data: Sequence[Maneuver]) -> float:
    """Return minus the logarithm of the likelihood of a fit, but for a constant.

    Output error counts in noise with a memory, estimated too; innovations are white.
    """
    if found.residual_kind == "innovation":
        # What was not measured has no innovation, and zeros would pass for small ones in their
        # covariance: the filter's own cost counts what was. It has the prior in it, which those
        # of whole data leave out.
        if any(m.held for m in data):
            return float(np.asarray(found.details["cost"]))
        residuals = np.concatenate(found.residuals)
        return 0.5 * len(residuals) * float(np.linalg.slogdet(np.cov(residuals.T))[1])
    motion = np.std(np.concatenate(found.residuals) + np.concatenate(found.fitted), axis=0)
    total = 0.0
    for j in range(len(motion)):
        left = [
            block_means(
                r[:, j : j + 1],
                block_length(m.dt_s, AR_STEP_S),
                None if m.sampled is None else m.sampled[:, j],
            )[:, 0]
            for r, m in zip(found.residuals, data, strict=True)
        ]
        count = sum(len(r) - HIGHEST_ORDER for r in left)
        none = [np.zeros((len(r), 0)) for r in left]
        moments = lagged_moments(left, none, HIGHEST_ORDER)
        moments += count * (LACK * motion[j]) ** 2 * np.eye(HIGHEST_ORDER + 1)
        _, innovation = fit_ar(moments, HIGHEST_ORDER)
        total += 0.5 * count * float(np.log(max(innovation / count, 1e-300)))
    return total
