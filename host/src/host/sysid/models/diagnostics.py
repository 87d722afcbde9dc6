"""Diagnostics of a fit: figures of fit, whiteness, identifiability, collinearity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from host.arrays import Array
from host.constants import ENTANGLED, NORMAL_95, SMALL_SHARE
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.uncertainty import covariance_root

RELATIVE_BOUND_LIMIT = 1.0  # standard error over the reference value: 100 %
EVEN_ODDS = 0.5  # probability of a bound above the limit: more likely than not
WEAK_PROBABILITY = 0.05  # the same: what a 95 % statement leaves
STANDARD_ERROR = "its standard error is"  # begins the reason of a flag
GRADES = NOT_IDENTIFIABLE, WEAKLY_IDENTIFIABLE = ("cannot be told", "doubtful")
SHRINKAGE_PRIOR_WIDTH = 3.0
DRAWS, DRAW_SEED = 2000, 1


@dataclass(frozen=True, slots=True)
class SignalFit:
    """Figures of fit of one output, of free simulation or one-step prediction as the result says.

    Attributes
    ----------
    name : str
    r_squared : float
        Coefficient of determination, 1 - e'e / sum (y - mean y)^2.
    nrmse : float
        Root mean square of the residual over the standard deviation of the output.
    theil : float
        Theil's inequality coefficient, rms(y - y_model) / (rms(y) + rms(y_model)); 0 is perfect.
    autocorrelation_outside : float
        Share of residual autocorrelations outside the 95 % limits of white noise.
    ljung_box_p : float
    """

    name: str
    r_squared: float
    nrmse: float
    theil: float
    autocorrelation_outside: float
    ljung_box_p: float


def signal_fits(
    names: Sequence[str], measured: Sequence[Array], residuals: Sequence[Array]
) -> tuple[SignalFit, ...]:
    """Return figures of fit per signal, maneuvers pooled.

    Parameters
    ----------
    names : sequence of str
        One per column.
    measured, residuals : sequence of Array
        Per maneuver (samples, columns).
    """
    result = []
    for column, name in enumerate(names):
        y = np.concatenate([m[:, column] - m[:, column].mean() for m in measured])
        raw = np.concatenate([m[:, column] for m in measured])
        e = np.concatenate([r[:, column] for r in residuals])
        power = float(y @ y)
        rms = float(np.sqrt(np.mean(e**2)))
        model = raw - e
        theil = rms / max(float(np.sqrt(np.mean(raw**2)) + np.sqrt(np.mean(model**2))), 1e-300)
        outside, p_value = whiteness([r[:, column] for r in residuals])
        result.append(
            SignalFit(
                name=name,
                r_squared=1.0 - float(e @ e) / power if power > 0.0 else float("nan"),
                nrmse=rms / float(np.sqrt(power / len(y))) if power > 0.0 else float("nan"),
                theil=theil,
                autocorrelation_outside=outside,
                ljung_box_p=p_value,
            )
        )
    return tuple(result)


def whiteness(residuals: Sequence[Array], lags: int = 25) -> tuple[float, float]:
    """Return the share of autocorrelations outside 95 % limits and the Ljung-Box p value.

    The statistic is Q = N (N + 2) sum r_k^2 / (N - k), chi-square with one degree of freedom per
    lag (Ljung & Box, Biometrika 65, 1978). White residuals leave 5 % outside, and p is above 0.05
    in 95 of 100 cases.
    """
    total = sum(len(e) for e in residuals)
    lags = min(lags, min(len(e) for e in residuals) // 4)
    power = sum(float(e @ e) for e in residuals)
    if power == 0.0 or lags < 1:
        return 0.0, 1.0
    correlation = np.array(
        [sum(float(e[k:] @ e[:-k]) for e in residuals) / power for k in range(1, lags + 1)]
    )
    outside = float(np.mean(np.abs(correlation) > NORMAL_95 / np.sqrt(total)))
    statistic = (
        total * (total + 2.0) * float(np.sum(correlation**2 / (total - np.arange(1, lags + 1))))
    )
    return outside, float(special.chdtrc(lags, statistic))


def reference_values(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    theta: Array,
    *,
    small_share: float = SMALL_SHARE,
) -> Array:
    """Return the value that each parameter's error is compared with.

    It is |parameter|, or, where its contribution (|parameter| times rms of its regressor) is below
    5 % of the largest of its equation, the value that would contribute 5 %. The equation with the
    largest contribution of a tied parameter decides. Regressors are taken about their mean, because
    the trim carries no information. With a `small_share` of zero the value is always |parameter|.

    Parameters
    ----------
    model : LinearModel
    maneuvers : sequence of Maneuver
    theta : Array, shape (P,)
        Estimate, the common parameters first.
    small_share : float
        The 5 % above.

    Returns
    -------
    Array, shape (common parameters,)
        In the units of each parameter.
    """
    spread = regressor_rms(model, maneuvers)
    rows = _reference_values(model, spread, np.asarray(theta)[None], small_share)
    return np.asarray(rows[0])


def _reference_values(model: LinearModel, spread: Array, theta: Array, small_share: float) -> Array:
    """Return reference values of many parameter vectors, (vectors, parameters)."""
    n, count = len(model.states), len(model.parameters)
    place = {p.name: k for k, p in enumerate(model.parameters)}
    entries = [
        (place[t.parameter], t.row, t.column + (n if t.matrix == "B" else 0), t.gain)
        for t in model.terms
        if t.matrix in "AB"
    ]
    wide = np.repeat(np.hstack([model.A, model.B])[None], len(theta), axis=0)
    for k, row, column, gain in entries:
        wide[:, row, column] += gain * theta[:, k]
    largest = np.max(np.abs(wide) * spread, axis=2)
    floor = np.full((len(theta), count), np.inf)
    for k, row, column, gain in entries:
        scale = abs(gain) * spread[column]
        if scale > 0.0:
            floor[:, k] = np.minimum(floor[:, k], small_share * largest[:, row] / scale)
    result = np.abs(theta[:, :count])
    return np.where(np.isfinite(floor), np.maximum(result, floor), result)


def regressor_rms(model: LinearModel, maneuvers: Sequence[Maneuver]) -> Array:
    """Return the rms about the mean of every state and input; 0 of a state that nobody measured.

    Its unit and size are the model's own: it sets no scale for the others of an equation.
    """
    columns = []
    for source, names in (("outputs", model.states), ("inputs", model.inputs)):
        for position, name in enumerate(names):
            if source == "outputs" and name not in model.outputs:
                columns.append(0.0)
                continue
            index = model.outputs.index(name) if source == "outputs" else position
            power = np.concatenate(
                [
                    getattr(m, source)[:, index] - getattr(m, source)[:, index].mean()
                    for m in maneuvers
                ]
            )
            columns.append(float(np.sqrt(np.mean(power**2))))
    return np.array(columns)


@dataclass(frozen=True, slots=True)
class IdentifiabilityFlag:
    """A parameter that these data do not identify, or only weakly, and why.

    Attributes
    ----------
    name : str
    relative_bound : float
        Standard error over the reference value of the (shrunk) estimate.
    probability : float
        Probability that the bound exceeds 100 % of the value.
    grade : str
        `NOT_IDENTIFIABLE` where that is more likely than not, `WEAKLY_IDENTIFIABLE` from
        `WEAK_PROBABILITY` on.
    reason : str
    """

    name: str
    relative_bound: float
    probability: float
    grade: str
    reason: str


@dataclass(frozen=True, slots=True)
class Identifiability:
    """Practical identifiability of a fit's parameters, and which of them are in doubt.

    Attributes
    ----------
    probability : float
        Probability that some bound exceeds 100 % of its value.
    flags : tuple of Refusal
        Both grades, in the order of the model. Those of an identifiable fit can only be weakly
        identifiable; of another one at least one of them is not identifiable.
    """

    probability: float
    flags: tuple[IdentifiabilityFlag, ...]

    @property
    def not_identifiable(self) -> bool:
        """Whether it is more likely than not that some bound exceeds its value."""
        return self.probability > EVEN_ODDS

    def names(self, *grades: str) -> tuple[str, ...]:
        """Return the names of parameters with these grades, by default with either."""
        return tuple(r.name for r in self.flags if not grades or r.grade in grades)


def shrunk_estimate(result: FitResult, maneuvers: Sequence[Maneuver]) -> tuple[Array, Array]:
    """Return mean and covariance of the parameters, shrunk towards zero where data inform little.

    Where the data cannot separate parameters of one equation, their estimates may have any size and
    cancel each other. Comparing a bound with such a value would hide that it is worthless. This is
    ridge regression (Hoerl & Kennard, Technometrics 12, 1970): each parameter gets a Gaussian prior
    about zero, `SHRINKAGE_PRIOR_WIDTH` times the value that alone would explain the whole state
    rate. Parameters that the data determine do not change.
    """
    model = result.model
    count = len(model.parameters)
    spread = regressor_rms(model, maneuvers)
    A, B, _, _ = model.matrices(result.estimate)
    z = [np.hstack([m.outputs[:, measured_columns(model)], m.inputs]) for m in maneuvers]
    wide = np.hstack([A, B])
    rates = np.concatenate([(block - block.mean(axis=0)) @ wide.T for block in z])
    rate_rms = np.sqrt(np.mean(rates**2, axis=0))
    n = len(model.states)
    prior = np.full(count, np.inf)
    for k, parameter in enumerate(model.parameters):
        for term in model.terms:
            if term.parameter == parameter.name and term.matrix in "AB":
                column = term.column + (n if term.matrix == "B" else 0)
                scale = abs(term.gain) * spread[column]
                if scale > 0.0:
                    prior[k] = min(prior[k], SHRINKAGE_PRIOR_WIDTH * rate_rms[term.row] / scale)
    covariance = result.covariance[:count, :count]
    has_prior = np.isfinite(prior)
    total = covariance + np.diag(np.minimum(prior, 1e100) ** 2) + 1e-300 * np.eye(count)
    mean = result.estimate[:count] - covariance @ np.linalg.solve(total, result.estimate[:count])
    posterior = covariance - covariance @ np.linalg.solve(total, covariance)
    return np.where(has_prior, mean, result.estimate[:count]), 0.5 * (posterior + posterior.T)


def measured_columns(model: LinearModel) -> list[int]:
    """Return the output that measures each state, the first output where none does."""
    return [model.outputs.index(s) if s in model.outputs else 0 for s in model.states]


def relative_bounds(
    result: FitResult, maneuvers: Sequence[Maneuver], *, small_share: float = SMALL_SHARE
) -> Array:
    """Return the relative Cramer-Rao bound: standard error over reference value, per parameter.

    Klein & Morelli, Aircraft System Identification, ch. 6.
    """
    count = len(result.model.parameters)
    mean, _ = shrunk_estimate(result, maneuvers)
    reference = reference_values(result.model, maneuvers, mean, small_share=small_share)
    return np.asarray(result.standard_error[:count] / np.maximum(reference, 1e-300))


def bound_exceedance_probability(
    result: FitResult, maneuvers: Sequence[Maneuver], *, small_share: float = SMALL_SHARE
) -> tuple[Array, float]:
    """Return the probability that each bound exceeds 100 % of its value, and that any does.

    The true value is as uncertain as its bound says, so that a single estimate decides badly near
    100 %. Values are therefore drawn at random from mean and covariance of `shrunk_estimate`, and
    each draw is compared with the bounds.

    Returns
    -------
    Array, shape (common parameters,)
    float
    """
    model, count = result.model, len(result.model.parameters)
    mean, covariance = shrunk_estimate(result, maneuvers)
    noise = np.random.default_rng(DRAW_SEED).standard_normal((DRAWS, count))
    draws = mean + noise @ covariance_root(covariance).T
    values = _reference_values(model, regressor_rms(model, maneuvers), draws, small_share)
    over = result.standard_error[:count] > RELATIVE_BOUND_LIMIT * values
    return np.asarray(np.mean(over, axis=0)), float(np.mean(np.any(over, axis=1)))


def assess_identifiability(
    result: FitResult, maneuvers: Sequence[Maneuver], *, small_share: float = SMALL_SHARE
) -> Identifiability:
    """Assess practical identifiability: grade every parameter whose bound may exceed its value.

    A single estimate cannot always show that its bound is too large: one with a bound of 500 % lies
    beyond twice its own bound in one of twenty fits. There are therefore two grades, by the
    probability for each parameter, and one `probability` for the whole fit.
    """
    relative = relative_bounds(result, maneuvers, small_share=small_share)
    single, any_of_them = bound_exceedance_probability(result, maneuvers, small_share=small_share)
    named = tuple(
        _identifiability_flag(result, int(k), float(relative[k]), float(single[k]))
        for k in np.flatnonzero(single > WEAK_PROBABILITY)
    )
    return Identifiability(any_of_them, named)


def identifiability_flags(
    result: FitResult, maneuvers: Sequence[Maneuver]
) -> tuple[IdentifiabilityFlag, ...]:
    """Return flags of the common parameters that these data identify weakly or not at all."""
    return assess_identifiability(result, maneuvers).flags


def _identifiability_flag(
    result: FitResult, k: int, relative: float, probability: float
) -> IdentifiabilityFlag:
    count = len(result.model.parameters)
    correlation = np.abs(result.correlation[k, :count])
    correlation[k] = 0.0
    partner = int(np.argmax(correlation))
    reason = f"{STANDARD_ERROR} {100.0 * relative:.0f} % of its value"
    if (relative > RELATIVE_BOUND_LIMIT) != (probability > EVEN_ODDS):
        reason += f", and above 100 % with a probability of {probability:.2f}"
    if correlation[partner] > ENTANGLED:
        reason += f"; its correlation with {result.names[partner]} is {correlation[partner]:.3f}"
    else:
        reason += "; the input excites it too little for this noise"
    grade = NOT_IDENTIFIABLE if probability > EVEN_ODDS else WEAKLY_IDENTIFIABLE
    return IdentifiabilityFlag(result.names[k], relative, probability, grade, reason)
