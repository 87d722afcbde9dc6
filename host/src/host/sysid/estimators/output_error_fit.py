"""Output error as a method: start values, search, intervals, result."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.coherence_inflation import driven_by_inputs
from host.sysid.estimators.output_error_ar_noise import (
    ArNoiseFit,
    fit_with_ar_noise,
    refit_without_driven,
)
from host.sysid.estimators.start_values import start_values
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.ar_noise import HIGHEST_ORDER
from host.sysid.numerics.coloured_residuals import coloured_score_covariance
from host.sysid.numerics.maneuver_agreement import maneuver_influence
from host.sysid.numerics.model_problems import output_problem
from host.sysid.numerics.output_error import unidentifiable_covariance, whitened_sensitivities
from host.sysid.numerics.output_error_problem import OutputProblem

NO_CONVERGENCE = "no convergence"
SAME_RATE = 1.02  # sample periods that differ by less: ceramic resonators do, by half a per cent


def fit_output_error(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    coloured_noise: bool = True,
    start: Array | None = None,
    highest_order: int = HIGHEST_ORDER,
    criterion: str = "bic",
    multiple_starts: bool = True,
    restarts: bool = True,
    model_error: bool = True,
) -> FitResult:
    """Fit by output error.

    Parameters
    ----------
    model, maneuvers
        Model and data; the states need not be measured.
    coloured_noise : bool
        Estimate AR models of the noise, refit with them and base the intervals on them (default);
        where the inputs drive the residual, noise is estimated without it and intervals are wider.
        Otherwise the noise is taken as white for the estimate, and the covariance is corrected by
        the residual autocorrelation (Morelli & Klein 1997), the standard that covers 87-90 %.
    start : Array, optional
        Whole start vector; by default from equation error.
    highest_order, criterion, multiple_starts, restarts
        See `fit_with_ar_noise`.
    model_error : bool
        Hold what the inputs drive outside the model; without, noise alone.

    Raises
    ------
    IdentificationError
        If no start is finite, the information is singular, or the noise of records of several
        rates shall have a memory.
    """
    problem = output_problem(model, maneuvers)
    if coloured_noise:
        _check_rates(maneuvers)
    first = start_values(problem) if start is None else np.asarray(start, dtype=np.float64)
    if len(first) != len(problem.names):
        raise IdentificationError(
            f"{len(first)} start values, {len(problem.names)} needed: {', '.join(problem.names)}"
        )
    problem.check_start(first)
    fit = fit_with_ar_noise(
        problem,
        first,
        highest_order=highest_order if coloured_noise else 0,
        criterion=criterion,
        multiple_starts=multiple_starts,
        restarts=restarts,
    )
    coherence = None
    if coloured_noise and highest_order > 0:
        fit, coherence = refit_without_driven(problem, fit, highest_order=highest_order)
    result = _result(problem, fit, coloured_noise)
    if coherence is None or not model_error:
        return result
    known = result.uncertainty
    lacks = driven_by_inputs(result, known, coherence)
    return result.with_uncertainty(known.with_model_error([lacks]))


def _result(problem: OutputProblem, fit: ArNoiseFit, coloured_noise: bool) -> FitResult:
    """Return a fit as the result of the method."""
    # Noise that is known is not judged by residuals.
    as_modelled = coloured_noise or bool(np.isfinite(problem.known_variance).all())
    covariance = fit.covariance if as_modelled else coloured_output_covariance(problem, fit)
    return FitResult(
        method="output error" if coloured_noise else "output error (white)",
        model=problem.model_at(fit.optimum.theta),
        names=problem.names,
        estimate=fit.optimum.theta,
        covariance=covariance,
        covariance_white=fit.covariance_white,
        degrees_of_freedom=fit.degrees_of_freedom,
        residuals=tuple(r.T.copy() for r in fit.optimum.residuals),
        fitted=tuple(r.y.T.copy() for r in fit.optimum.responses),
        residual_kind="output",
        noise_covariance=problem.residual_covariance(fit.optimum.residuals),
        iterations=fit.optimum.iterations,
        converged=fit.optimum.converged,
        warnings=_warnings(problem, fit),
        details={
            "cost": fit.optimum.cost,
            "last_step_bounds": fit.optimum.step,
            "refits": float(fit.refits),
            "noise_orders": np.array([float(n.order) for n in fit.noise]),
            "innovation_variance": fit.innovation_variance,
            **_maneuver_influence(problem, fit),
        },
    )


def sample_periods(maneuvers: Sequence[Maneuver]) -> list[float]:
    """Return the different sample periods, s; those of two clocks of one rate are one."""
    found: list[float] = []
    for dt_s in sorted(m.dt_s for m in maneuvers):
        if not found or dt_s > SAME_RATE * found[-1]:
            found.append(dt_s)
    return found


def _check_rates(maneuvers: Sequence[Maneuver]) -> None:
    """Refuse records of several rates: an autoregression is that of one sample period."""
    periods = sample_periods(maneuvers)
    if len(periods) > 1:
        raise IdentificationError(
            f"output-error estimates one noise model, and records of {periods[0]:g} and"
            f" {periods[-1]:g} s a sample have two; use output-error-white or filter-error"
        )


def _maneuver_influence(problem: OutputProblem, fit: ArNoiseFit) -> dict[str, float | Array]:
    size = len(problem.names)
    parts, scores = [], []
    slopes = whitened_sensitivities(problem, fit.optimum.responses, fit.noise)
    for number, residual in enumerate(fit.optimum.residuals):
        part, score = np.zeros((size, size)), np.zeros(size)
        own = problem.columns(number)
        for j, ar_model in enumerate(fit.noise):
            J = slopes[number][j]
            white = ar_model.whiten(residual[j][:, None])[:, 0]
            part[np.ix_(own, own)] += J.T @ J / fit.innovation_variance[j]
            score[own] += J.T @ white / fit.innovation_variance[j]
        parts.append(part)
        scores.append(score)
    return maneuver_influence(parts, scores, fit.covariance)


def _warnings(problem: OutputProblem, fit: ArNoiseFit) -> tuple[str, ...]:
    warnings = []
    if not fit.optimum.converged:
        warnings.append(
            f"{NO_CONVERGENCE}: the last step was {fit.optimum.step:.3g} Cramer-Rao bounds long"
        )
    on_bound = [n for n, free in zip(problem.names, fit.optimum.free, strict=True) if not free]
    if on_bound:
        warnings.append(f"on a bound, so without an interval: {', '.join(on_bound)}")
    return tuple(warnings)


def coloured_output_covariance(problem: OutputProblem, fit: ArNoiseFit) -> Array:
    """Return M^-1 (sum S' R S + P) M^-1, the white covariance corrected for coloured residuals.

    P is the precision of the priors.

    Morelli & Klein, Journal of Guidance, Control and Dynamics 20 (1997).
    """
    white = fit.covariance_white
    # What a prior tells is as uncertain as the prior: data say nothing along its direction.
    score_covariance = np.diag(problem.prior_precision)
    # Residuals of a clean column and of a coarse step do not show the noise that counts.
    squares = np.sum([np.sum(r**2, axis=1) for r in fit.optimum.residuals], axis=0)
    unidentifiable = np.where(
        fit.optimum.variance <= problem.least_variance,
        fit.optimum.variance - squares / problem.counts,
        0.0,
    )
    for number, response in enumerate(fit.optimum.responses):
        columns = problem.columns(number)
        for j, variance in enumerate(fit.optimum.variance):
            seen = problem.seen(number, j)
            residual, slope = fit.optimum.residuals[number][j], response.sensitivities[j]
            if seen is not None:
                residual, slope = residual[seen], slope[seen]
            part = coloured_score_covariance(residual, slope)
            if unidentifiable[j] > 0.0:
                part += unidentifiable[j] * slope.T @ slope
            part /= variance**2
            score_covariance[np.ix_(columns, columns)] += part
    result = white @ score_covariance @ white
    result = 0.5 * (result + result.T)
    not_positive = np.diag(result) <= 0.0
    result[not_positive], result[:, not_positive] = white[not_positive], white[:, not_positive]
    result += unidentifiable_covariance(fit.optimum.information, fit.optimum.free)
    return np.asarray(result, dtype=np.float64)
