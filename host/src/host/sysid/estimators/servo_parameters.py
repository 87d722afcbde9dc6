"""Delay, bandwidth and rate limit of servos, where an input is a command.

The delay is estimated jointly with a model's parameters by its profile likelihood: a fit of all
parameters at each of some delays, the prior of the delay added, a parabola about the best. It is
the same for every method and needs no start. Linearised about the last delay the fit takes the
input's rate for a lead and goes to where the prior is.

What output error leaves is weighed as noise with a memory. Gusts are slow, a delay shows at the
edges of the inputs: as white noise the gusts hide it there (0.5 m/s, no vanes: -7 to 13 ms of 2,
and L_p goes with it by 4 % a millisecond), whitened it is known to 2 ms.

Bandwidth and rate limit are carried: 1 / (2 pi f) is a delay too, and a free bandwidth with a
free delay draws the filter to 3.5 Hz on thor75, where 6 Hz and 50 ms are published.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.constants import ENTANGLED, NORMAL_95, POSTERIOR_PRIOR_RATIO
from host.errors import IdentificationError
from host.instrument.servo_prior import ServoPrior
from host.sysid.estimators.servo_delay_profile import (
    LEAST,
    MOST,
    Behind,
    CoarseDelays,
    DelayProfile,
    Fit,
)
from host.sysid.models.fit_result import FitResult
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.uncertainty import consider_covariance

DELAY = "servo_delay_s"
SERVO = (DELAY, "servo_bandwidth_hz", "servo_rate_limit_radps")
WIDE_DELAY_S = 0.02  # one deviation: above it the search begins with delays far apart
RIVAL_S = 0.04  # from the best delay: another optimum, not its own slope
FINE_S = 0.01  # between the delays about the best, at first
STEP_SHRINKS = 5.0
SHORT_STEPS, LEAST_STEP_S = 4.0, 3e-3  # deviations of the delay that the parabola may span
STILL = 1e-4  # of the motion of the surface: what moves it by less moves nothing


@dataclass(frozen=True, slots=True)
class ServoNumber:
    """One number of the servos with its 95 % half-width, that of the prior, and whether the data
    inform it."""

    name: str
    value: float
    half_width: float
    prior_half_width: float
    data_informed: bool


@dataclass(frozen=True)
class ServoEstimate:
    """The servos, and what they leave open of a model's parameters.

    Attributes
    ----------
    surfaces : tuple of str
        Inputs that are commands.
    numbers : tuple of ServoNumber
        In the order of `SERVO`.
    names : tuple of str
        Common parameters of the model that they are estimated with.
    covariance : Array, shape (P, P)
        What the uncertain servo adds to that of these.
    correlation : dict
        Correlation of each parameter with the servo.
    rival_s : float or None
        A delay far from this one at which the method fits better: the search had another optimum.
    """

    surfaces: tuple[str, ...]
    numbers: tuple[ServoNumber, ...]
    names: tuple[str, ...]
    covariance: Array
    correlation: dict[str, float]
    rival_s: float | None = None

    @property
    def setting(self) -> tuple[float, float, float]:
        """Delay (s), bandwidth (Hz), rate limit (rad/s)."""
        delay, bandwidth, rate = (n.value for n in self.numbers)
        return delay, bandwidth, rate

    @property
    def alike(self) -> tuple[str, ...]:
        """Parameters that cannot be separated from the servo."""
        return tuple(n for n, r in self.correlation.items() if r > ENTANGLED)

    @property
    def wide_prior(self) -> bool:
        """Whether next to nothing is known of the delay beforehand."""
        return self.numbers[0].prior_half_width > NORMAL_95 * WIDE_DELAY_S

    @property
    def unknown_delay(self) -> str:
        """Why the delay is not known, neither beforehand nor by the data; empty where it is."""
        delay = self.numbers[0]
        if not self.wide_prior:
            return ""
        if not delay.data_informed:
            return "the data do not tell it"
        if delay.value + delay.half_width < 0.0:
            return "no surface is ahead of its command"
        if self.rival_s is not None:
            return f"{1e3 * self.rival_s:.0f} ms fit better still"
        return ""

    def added_to(self, result: FitResult) -> FitResult:
        """Return a fit behind these servos with their uncertainty in its covariance."""
        both = [(k, result.index(n)) for k, n in enumerate(self.names) if n in result.names]
        own = np.array([k for k, _ in both], dtype=np.int64)
        there = np.array([k for _, k in both], dtype=np.int64)
        covariance = result.covariance.copy()
        covariance[np.ix_(there, there)] += self.covariance[np.ix_(own, own)]
        return replace(result, covariance=covariance)


def estimate_servo(
    model: LinearModel,
    behind: Behind,
    commanded: Sequence[str],
    prior: ServoPrior,
    fit: Fit,
    coarse: CoarseDelays,
) -> ServoEstimate:
    """Return the servos by a method, the delay estimated jointly with a model's parameters.

    Parameters
    ----------
    model : LinearModel
    behind : callable
        Maneuvers with the surfaces behind servos of these numbers.
    commanded : sequence of str
        Inputs of the model that are commands.
    prior : ServoPrior
    fit : callable
        The method.
    coarse : CoarseDelays
        Where to begin, if next to nothing is known: far from the best delay a filter finds other
        optima.

    Raises
    ------
    IdentificationError
        If the search fails.
    """
    profile = DelayProfile(model, behind, prior, fit)
    wide = prior.sd[0] > WIDE_DELAY_S
    step = FINE_S if wide else prior.sd[0]
    profile.ask([coarse.best if wide else prior.mean[0]])
    delay, best, step, curvature = _least(profile, step)
    rival_s = _rival(profile, best, coarse.hollows if wide else [])
    at = profile.fits[best]
    sd = min(_colour(at) * float(curvature**-0.5), prior.sd[0])
    count = len(model.parameters)
    below, above = (profile.fits[round(best + d, 5)] for d in (-step, step))
    apart = above.estimate[:count] - below.estimate[:count]
    slope = apart / (2.0 * step)
    shifts = [np.append(slope * sd, sd)]
    for k in (1, 2):
        shifts += _servo_shift(profile, best, k, count)
    found = _estimate(model, tuple(commanded), delay, prior, at, np.stack(shifts))
    return replace(found, rival_s=rival_s)


def _rival(profile: DelayProfile, best: float, hollows: Sequence[float]) -> float | None:
    """Return a delay that fits better than the best one near the start; None without any."""
    asked = [d for d in hollows if abs(d - best) >= RIVAL_S]
    profile.ask(asked)
    better = [d for d in asked if profile.costs.get(d, np.inf) < profile.costs[best]]
    return min(better, key=profile.costs.__getitem__) if better else None


def _least(profile: DelayProfile, step: float) -> tuple[float, float, float, float]:
    """Return the delay of the least cost by a parabola, the delay asked next to it, the step, and
    the curvature.

    The step shrinks until the parabola is no wider than what it tells: in calm air one over steps
    of 13 ms is 8 ms off, by five of its half-widths.
    """
    while True:
        for _ in range(8):
            best = profile.best
            profile.ask([best - step, best + step])
            if profile.best == best:
                break
        below, above = round(best - step, 5), round(best + step, 5)
        if below not in profile.costs or above not in profile.costs:
            raise IdentificationError("the fit fails next to the best delay")
        low, least, high = (profile.costs[d] for d in (below, best, above))
        curvature = max((low - 2.0 * least + high) / step**2, profile.prior.sd[0] ** -2)
        delay = float(np.clip(best - 0.5 * (high - low) / step / curvature, below, above))
        if step <= max(SHORT_STEPS * curvature**-0.5, LEAST_STEP_S):
            return delay, best, step, curvature
        profile.ask([delay])
        step /= STEP_SHRINKS


def _colour(found: FitResult) -> float:
    """Return the factor by which coloured innovations widen: the median over the parameters."""
    if found.residual_kind != "innovation":
        return 1.0
    count = len(found.model.parameters)
    white = np.diag(found.covariance_white)[:count]
    ratio = np.diag(found.covariance)[:count][white > 0.0] / white[white > 0.0]
    return float(np.sqrt(max(np.median(ratio), 1.0))) if len(ratio) else 1.0


def _servo_shift(profile: DelayProfile, delay_s: float, k: int, count: int) -> list[Array]:
    """Return the shift of parameters and delay for one deviation of bandwidth or rate limit.

    With the bandwidth the delay moves so that their sum stays: the data see little else.
    """
    prior = profile.prior
    usual, other = np.array(prior.mean), np.array(prior.mean)
    other[k] = np.clip(other[k] + prior.sd[k], LEAST[k], MOST[k])
    usual[0] = other[0] = delay_s
    if k == 1:
        other[0] += (1.0 / usual[1] - 1.0 / other[1]) / (2.0 * np.pi)
    there = profile.behind((float(other[0]), float(other[1]), float(other[2])))
    here = profile.behind((float(usual[0]), float(usual[1]), float(usual[2])))
    change = sum(
        float(np.sum((a.inputs - b.inputs) ** 2)) for a, b in zip(there, here, strict=True)
    )
    motion = sum(float(np.sum(np.var(m.inputs, axis=0))) * m.samples for m in here)
    if change < STILL**2 * motion:
        return []  # a limit that is never reached
    at = profile.fits[delay_s]
    moved = profile.fit(profile.model, there, at).estimate[:count] - at.estimate[:count]
    return [np.append(moved, other[0] - usual[0])]


def considered_servo(
    model: LinearModel, behind: Behind, commanded: Sequence[str], prior: ServoPrior, fit: Fit
) -> ServoEstimate:
    """Return the servos at their prior mean as consider parameters: not estimated, their deviations
    in the covariance by one shift of the estimate each."""
    count = len(model.parameters)
    first = fit(model, behind(prior.mean), None)
    shifts = []
    for k in range(len(SERVO)):
        other = [float(x) for x in prior.mean]
        other[k] = float(np.clip(other[k] + prior.sd[k], LEAST[k], MOST[k]))
        there = behind((other[0], other[1], other[2]))
        moved = fit(model, there, first).estimate - first.estimate
        shifts.append(np.append(moved[:count], prior.sd[0] if k == 0 else 0.0))
    return _estimate(model, tuple(commanded), prior.mean[0], prior, first, np.stack(shifts))


def _estimate(
    model: LinearModel,
    surfaces: tuple[str, ...],
    delay_s: float,
    prior: ServoPrior,
    found: FitResult,
    shifts: Array,
) -> ServoEstimate:
    """Return the estimate of shifts of parameters, and of the delay behind them."""
    count = len(model.parameters)
    added = consider_covariance(shifts)
    sd = (min(float(np.sqrt(added[-1, -1])), prior.sd[0]), *prior.sd[1:])
    numbers = tuple(
        ServoNumber(
            name,
            value,
            NORMAL_95 * sd[k],
            NORMAL_95 * prior.sd[k],
            data_informed=bool(sd[k] < POSTERIOR_PRIOR_RATIO * prior.sd[k]),
        )
        for k, (name, value) in enumerate(zip(SERVO, (delay_s, *prior.mean[1:]), strict=True))
    )
    part = added[:count, :count]
    total = np.maximum(np.diag(part) + np.diag(found.covariance)[:count], 1e-300)
    alike = np.sqrt(np.clip(np.diag(part) / total, 0.0, 1.0))
    correlation = {p.name: float(r) for p, r in zip(model.parameters, alike, strict=True)}
    return ServoEstimate(surfaces, numbers, tuple(correlation), part, correlation)
