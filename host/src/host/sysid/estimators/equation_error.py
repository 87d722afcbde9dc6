"""Equation error: regress measured rates and accelerations on measured states and inputs.

Ordinary, weighted, robust and total least squares solve the same regression equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array, IntArray
from host.constants import HUBER_LIMIT, MEDIAN_TO_SIGMA
from host.errors import IdentificationError
from host.sysid.estimators.regression import (
    NO_EXCITATION,
    RegressionEquation,
    normal_equations,
    regression_equations,
    solve_least_squares,
)
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.coloured_residuals import coloured_score_covariance
from host.sysid.numerics.information_inverse import covariance_from_information


def fit_equation_error(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    variant: str = "ordinary",
    deviations: tuple[Array, Array] | None = None,
    bandwidth: float | None = None,
    use_rates: bool = True,
) -> FitResult:
    """Fit by equation error (EQUATIONS.md, eq. 19).

    Parameters
    ----------
    model, maneuvers
        See `regression_equations`.
    variant : str
        ``ordinary``, ``weighted`` (equations weighted by their residual variance; differs only
        with tied entries), ``robust`` (Huber) or ``total`` (errors in states as well as rates).
    deviations : tuple of Array, optional
        For ``total``: noise standard deviations of the states and of the rates, each of shape
        (n,). By default from third differences, which take fast signals for noise.
    bandwidth, use_rates
        See `regression_equations`.
    """
    names, equations = regression_equations(
        model, maneuvers, bandwidth=bandwidth, use_rates=use_rates
    )
    warnings: list[str] = []
    sample_weights: list[Array] = [np.ones(len(block.dependent)) for block in equations]
    iterations = 1
    theta = (
        _total(model, equations, len(names), deviations)
        if variant == "total"
        else solve_least_squares(equations, len(names))
    )
    if variant in ("weighted", "robust"):
        theta, iterations = _reweighted(equations, theta, sample_weights, variant == "robust")
    elif variant not in ("ordinary", "total"):
        raise IdentificationError(
            f"equation error '{variant}' unknown; use ordinary, weighted, robust or total"
        )
    used = _pseudo_equations(equations, theta, sample_weights) if variant == "robust" else equations
    scales = _equation_scales(used, theta, robust=False, dof=len(names))
    normal, _ = normal_equations(used, len(names), scales**-2.0)
    white = covariance_from_information(normal)
    coloured = coloured_covariance(used, theta, white, scales)
    labels = sorted({block.equation for block in equations})
    residuals, fitted = [], []
    for number in range(len(maneuvers)):
        own = [block for block in equations if block.maneuver == number]
        fitted.append(np.column_stack([block.fitted(theta) for block in own]))
        residuals.append(np.column_stack([block.dependent for block in own]) - fitted[-1])
    stacked = np.vstack(residuals)
    if len(labels) != stacked.shape[1]:
        warnings.append("some equations are missing in some maneuvers")
    return FitResult(
        method=f"equation error ({variant})",
        model=model,
        names=names,
        estimate=theta,
        covariance=coloured,
        covariance_white=white,
        degrees_of_freedom=np.full(len(names), float(max(len(stacked) - len(names), 1))),
        residuals=tuple(residuals),
        fitted=tuple(fitted),
        residual_kind="rate",
        noise_covariance=np.atleast_2d(np.cov(stacked.T)),
        iterations=iterations,
        converged=True,
        warnings=tuple(warnings),
    )


def _reweighted(
    equations: Sequence[RegressionEquation],
    theta: Array,
    sample_weights: list[Array],
    robust: bool,
) -> tuple[Array, int]:
    """Return the solution by weights that follow its residuals, and iterations.

    Those of samples are overwritten, where it is robust.
    """
    iterations = 1
    while iterations < 50:
        iterations += 1
        scales = _equation_scales(equations, theta, robust=robust)
        before = theta
        if robust:
            for k, block in enumerate(equations):
                size = np.abs(block.residual(theta)) / scales[k]
                sample_weights[k] = np.minimum(1.0, HUBER_LIMIT / np.maximum(size, 1e-12))
        theta = solve_least_squares(_weighted(equations, sample_weights), len(theta), scales**-2.0)
        if np.all(np.abs(theta - before) <= 1e-8 * np.abs(theta) + 1e-14):
            break
    return theta, iterations


def _weighted(
    equations: Sequence[RegressionEquation], weights: Sequence[Array]
) -> list[RegressionEquation]:
    result = []
    for block, weight in zip(equations, weights, strict=True):
        root = np.sqrt(weight)
        result.append(
            RegressionEquation(
                block.equation,
                block.label,
                block.maneuver,
                block.dependent * root,
                block.columns,
                block.active_regressors * root[:, None],
                block.noisy_regressors,
            )
        )
    return result


def _pseudo_equations(
    equations: Sequence[RegressionEquation], theta: Array, weights: Sequence[Array]
) -> list[RegressionEquation]:
    """Return equations whose residuals are the pseudo-residuals of Huber's M-estimate.

    The pseudo-residual is psi(r) / mean psi'(r) with the clipped residual psi, and has the
    first-order correction for the number of unknowns (Huber, Annals of Statistics 1, 1973; Robust
    Statistics, sec. 7.8). Ordinary least squares on these equations gives the same estimate and
    Huber's covariance.
    """
    slope: dict[int, float] = {}
    for equation in {block.equation for block in equations}:
        own = [k for k, block in enumerate(equations) if block.equation == equation]
        share = float(np.mean(np.concatenate([weights[k] for k in own]) >= 1.0))
        unknowns = len(equations[own[0]].columns)
        samples = sum(len(weights[k]) for k in own)
        correction = 1.0 + unknowns / samples * (1.0 - share) / max(share, 1e-12)
        slope[equation] = max(share, 1e-12) / correction
    return [
        replace(
            block,
            dependent=block.fitted(theta) + weight * block.residual(theta) / slope[block.equation],
        )
        for block, weight in zip(equations, weights, strict=True)
    ]


def _equation_scales(
    equations: Sequence[RegressionEquation], theta: Array, *, robust: bool, dof: int = 0
) -> Array:
    """Return the residual scale of each equation, pooled over its maneuvers."""
    scale: dict[int, float] = {}
    for equation in {block.equation for block in equations}:
        own = [block for block in equations if block.equation == equation]
        residual = np.concatenate([block.residual(theta) for block in own])
        if robust:
            value = MEDIAN_TO_SIGMA * float(np.median(np.abs(residual)))
        else:
            active = len(own[0].columns) if dof else 0
            value = float(np.sqrt(residual @ residual / max(len(residual) - active, 1)))
        size = max(float(np.max(np.abs(block.dependent), initial=0.0)) for block in own)
        scale[equation] = max(value, 1e-12 * size, 1e-150)
    return np.array([scale[block.equation] for block in equations])


def coloured_covariance(
    equations: Sequence[RegressionEquation], theta: Array, white: Array, scales: Array
) -> Array:
    """Return (X'X)^-1 (sum X' R X) (X'X)^-1, the covariance corrected for coloured residuals.

    EQUATIONS.md, eq. 34.
    """
    score_covariance = np.zeros_like(white)
    for block, scale in zip(equations, scales, strict=True):
        residual = block.residual(theta)
        part = coloured_score_covariance(residual, block.active_regressors) / scale**4
        score_covariance[np.ix_(block.columns, block.columns)] += part
    result = white @ score_covariance @ white
    result = 0.5 * (result + result.T)
    low = np.diag(result) <= 0.0
    if low.any():
        result[low] = white[low]
        result[:, low] = white[:, low]
    return np.asarray(result, dtype=np.float64)


def _total(
    model: LinearModel,
    equations: Sequence[RegressionEquation],
    n_parameters: int,
    deviations: tuple[Array, Array] | None,
) -> Array:
    """Solve by mixed total least squares, one equation at a time.

    Exact columns are eliminated by QR; the solution is the right singular vector of the smallest
    singular value of [X z] (Van Huffel & Vandewalle, The Total Least Squares Problem, sec. 3.5).
    Noisy columns and the dependent variable are first scaled to equal noise, which is given or
    estimated from third differences (20 times the variance of white noise).
    """
    theta = np.full(n_parameters, np.nan)
    for equation in sorted({block.equation for block in equations}):
        own = [block for block in equations if block.equation == equation]
        X = np.vstack([block.regressors for block in own])
        y = np.concatenate([block.dependent for block in own])
        active = np.flatnonzero(X.any(axis=0))
        if not np.all(np.isnan(theta[active])):
            raise IdentificationError(
                "total least squares takes one equation at a time, and this"
                " model ties entries of several: use equation-error-weighted"
            )
        noisy = own[0].noisy_regressors[active] > 0.0
        block = np.column_stack([X[:, active[noisy]], y])
        ends = np.cumsum([len(block.dependent) for block in own])[:-1]
        thirds = np.vstack([np.diff(part, n=3, axis=0) for part in np.split(block, ends)])
        noise = np.sqrt(np.mean(thirds**2, axis=0) / 20.0)
        if deviations is not None and equation < len(model.states):
            noise = np.append(_noise_of_columns(model, active[noisy], deviations[0]), 0.0)
            noise[-1] = deviations[1][equation]
        noise = np.maximum(noise, 1e-12 * np.max(np.abs(block), axis=0) + 1e-300)
        theta[active[noisy]], theta[active[~noisy]] = _mixed(block, noise, X[:, active[~noisy]])
    if np.isnan(theta).any():
        raise IdentificationError(NO_EXCITATION)
    return theta


def _noise_of_columns(model: LinearModel, parameters: IntArray, states: Array) -> Array:
    """Return the noise of each regressor column: gain times the noise of its state."""
    entries = model.entries("AB")
    power = np.zeros(len(parameters))
    for k, parameter in enumerate(parameters):
        for t in np.flatnonzero(entries.parameter == parameter):
            if entries.column[t] < len(model.states):
                power[k] += (entries.gain[t] * states[entries.column[t]]) ** 2
    return np.sqrt(power)


def _mixed(block: Array, noise: Array, exact: Array) -> tuple[Array, Array]:
    """Return the factors of the noisy columns [X y] and of the exact ones."""
    reduced = block / noise
    if exact.shape[1]:
        Q, _ = np.linalg.qr(exact)
        reduced = reduced - Q @ (Q.T @ reduced)
    _, _, vectors = np.linalg.svd(reduced, full_matrices=False)
    last = vectors[-1]
    if abs(last[-1]) < 1e-12:
        raise IdentificationError("total least squares has no solution on these data")
    noisy = -last[:-1] / last[-1] * noise[-1] / noise[:-1]
    if not exact.shape[1]:
        return noisy, np.zeros(0)
    rest = block[:, -1] - block[:, :-1] @ noisy
    return noisy, np.linalg.lstsq(exact, rest, rcond=None)[0]
