"""Innovations of a filter-error estimate and their sensitivities: one-step update, colour.

The score of a sample is its whitened innovation times the sensitivities. Under a correct model the
scores of neighbouring samples are independent, and their variance is the information. Where
airspeed, attitude and gusts make the aircraft nonlinear, neighbouring scores correlate, and an
estimate scatters by more than the Cramer-Rao bound.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray
from host.constants import NORMAL_95
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.coloured_residuals import coloured_score_covariance
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.model_problems import innovation_problem

PROCESS = "log_process."


@dataclass(frozen=True)
class Innovations:
    """Whitened innovations of every maneuver and their slopes at an answer.

    Attributes
    ----------
    theta : Array, shape (P,)
    covariance : Array, shape (P, P)
        Inverse of the information at the answer.
    inverse : Array, shape (P, P)
        The same of the model alone, both noises fixed; used by the one-step update.
    process : tuple of str
    e : list of Array, each (samples, p)
    whiten : callable
        What makes innovations of a maneuver, by its number, white and of unit variance.
    sampled : list of Array or None, each (samples, p)
        At which samples each output was measured; None: at all.
    sensitivities : list of Array, each (samples, p, P)
        Sensitivities of the whitened innovations.
    """

    theta: Array
    covariance: Array
    inverse: Array
    process: tuple[str, ...]
    e: list[Array]
    whiten: Callable[[int, Array], Array]
    sampled: list[BoolArray | None]
    sensitivities: list[Array]

    def innovations(self, model: LinearModel, changed: Sequence[Maneuver]) -> list[Array] | None:
        """Return the innovations of another model or other data, noise and parameters as estimated.

        None if the filter fails.
        """
        # e = y - C x_predicted (Jategaonkar, Flight Vehicle System Identification, 2nd ed., ch. 5).
        point = innovation_problem(model, changed, self.process).evaluate(self.theta)
        if point is None:
            return None
        return [point.as_filtered(k) for k in range(len(changed))]

    def coloured_covariance(self) -> Array:
        """Return the covariance corrected for coloured innovations; no variance becomes smaller.

        Filter error takes innovations for white; where the model lacks something they are not. The
        correction is that of output error (Morelli & Klein 1997).
        """
        score_covariance = np.zeros_like(self.covariance)
        for number, (e, sensitivity) in enumerate(zip(self.e, self.sensitivities, strict=True)):
            white = self.whiten(number, e)
            for part in score_covariances(white, sensitivity, self.sampled[number]):
                score_covariance += part
        corrected = self.covariance @ score_covariance @ self.covariance
        factor = np.sqrt(
            np.maximum(np.diag(corrected) / np.maximum(np.diag(self.covariance), 1e-300), 1.0)
        )
        return np.asarray(self.covariance * np.outer(factor, factor))


def driven_states(result: FitResult) -> tuple[str, ...]:
    """Return the states that process noise of a fit drives; none of other methods."""
    return tuple(n.removeprefix(PROCESS) for n in result.names if n.startswith(PROCESS))


def innovations_of(
    result: FitResult, model: LinearModel, maneuvers: Sequence[Maneuver]
) -> Innovations | None:
    """Return the innovations of a filter-error result on this model; None if the filter fails."""
    theta, covariance = result.estimate, result.covariance_white
    process = driven_states(result)
    problem = innovation_problem(model, maneuvers, process)
    count = problem.n_model
    problem.set_steps(result.standard_error[:count])
    point = problem.evaluate(theta)
    if point is None:
        return None
    sensitivities = problem.whitened_slopes(theta, point)
    own = [J.reshape(-1, len(theta))[:, :count] for J in sensitivities]
    inverse = np.zeros_like(covariance)
    inverse[:count, :count] = covariance_from_information(
        np.diag(problem.output_problem.prior_precision) + sum(J.T @ J for J in own)
    )
    return Innovations(
        theta=theta,
        covariance=covariance,
        inverse=inverse,
        process=process,
        e=[point.as_filtered(k) for k in range(len(maneuvers))],
        whiten=point.whitened,
        sampled=[m.sampled for m in maneuvers],
        sensitivities=sensitivities,
    )


def score_covariances(
    white: Array, sensitivities: Array, sampled: BoolArray | None
) -> Iterator[Array]:
    """Yield the covariance of the score of every output's innovations, which may be coloured.

    Parameters
    ----------
    white : Array, shape (samples, p)
    sensitivities : Array, shape (samples, p, P)
    sampled : Array or None, shape (samples, p)
        What was not measured has no innovation; neighbours are those that were.

    Yields
    ------
    Array, shape (P, P)
    """
    for j in range(white.shape[1]):
        seen = slice(None) if sampled is None else sampled[:, j]
        yield coloured_score_covariance(white[seen, j], sensitivities[seen, j])


WINDOW_S = 1.0  # longest lag: more than a short period, most of a dutch roll
REPORTED_FACTOR = 1.25  # times wider
QUANTILE = (NORMAL_95, 2.9694, 0.416, -0.5324)  # 97.5 %, lags weighted by a triangle


def hac_inflation(
    sensitivities: Sequence[Array], white: Sequence[Array], steps_s: Sequence[float], inverse: Array
) -> Array:
    """Return the factor by which each standard error is too small, at least 1, (P,).

    The covariance is M^-1 Omega M^-1 (White, Econometrica 50, 1982), with Omega the long-run
    variance of the scores, lags weighted by a triangle (Newey & West, Econometrica 55, 1987). Omega
    is uncertain itself: the quantile that allows for it is a cubic in the share of the record that
    the window covers (Kiefer & Vogelsang, Econometric Theory 21, 2005).

    Parameters
    ----------
    sensitivities : sequence of Array
        Per maneuver, of the whitened innovations, (samples, p, P).
    white : sequence of Array
        Per maneuver, the whitened innovations, (samples, p).
    steps_s : sequence of float
        Sample period of each maneuver.
    inverse : Array, shape (P, P)
        Inverse of the whole information.
    """
    hac_variance, score_variance = np.zeros(len(inverse)), np.zeros(len(inverse))
    record_s = sum(len(e) * dt_s for e, dt_s in zip(white, steps_s, strict=True))
    share = min(WINDOW_S / record_s, 1.0)
    quantile_ratio = sum(c * share**k for k, c in enumerate(QUANTILE)) / QUANTILE[0]
    for sensitivity, e, dt_s in zip(sensitivities, white, steps_s, strict=True):
        score = np.einsum("tpk,tp->tk", sensitivity, e) @ inverse
        window = max(1, round(WINDOW_S / dt_s))
        # Sums over every window, also those beyond an end, weight the lags by a triangle.
        total = np.cumsum(np.pad(score, ((window, window), (0, 0))), axis=0)
        hac_variance += np.sum((total[window:] - total[:-window]) ** 2, axis=0) / window
        flat = sensitivity.reshape(-1, len(inverse))
        score_variance += np.einsum("ka,ab,bk->k", inverse, flat.T @ flat, inverse)
    ratio = np.sqrt(hac_variance / np.maximum(score_variance, 1e-300))
    return np.asarray(np.maximum(quantile_ratio * ratio, 1.0), dtype=np.float64)


def inflation_lines(model: LinearModel, factor: Array) -> list[str]:
    """Return a sentence that names the parameters widened by much, or nothing."""
    named = [
        f"{parameter.name} {times:.1f}"
        for parameter, times in zip(model.parameters, factor, strict=False)
        if times >= REPORTED_FACTOR
    ]
    if not named:
        return []
    return [
        f"the model does not follow this motion throughout: intervals widened {', '.join(named)}"
        " times; such ones held 90-92 % of cases in gusts, not 95, Cm_alpha 83"
        " (host/studies/nonlinear_gusts.md)"
    ]
