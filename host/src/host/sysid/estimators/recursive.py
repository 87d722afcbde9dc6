"""Recursive (real-time) estimation: least squares and regression on Fourier transforms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.equation_error import fit_equation_error
from host.sysid.estimators.regression import (
    RegressionEquation,
    regression_equations,
    solve_normal_equations,
)
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import EntryTable, LinearModel
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.output_error_problem import check_shapes

Spectrum = NDArray[np.complexfloating]
START_VARIANCE = 1e8  # of scaled regressors: a start with negligible weight
LEAST_WEIGHT = 1e-150  # of a sample long forgotten; its square is still a number
SPACING_HZ = 0.04  # spacing of the running transforms


def update(theta: Array, P: Array, regressors: Array, targets: Array, forgetting: float) -> Array:
    """Run recursive least squares over samples, in place.

    The gain is K = P x / (lambda + x'P x); theta moves by K (z - x'theta), P becomes (P - K x'P) /
    lambda with the forgetting factor lambda (EQUATIONS.md, eq. 21).

    Parameters
    ----------
    theta : Array, shape (n,)
        Estimate before and after.
    P : Array, shape (n, n)
        Its covariance in units of the residuals' variance, before and after.
    regressors : Array, shape (samples, n)
    targets : Array, shape (samples,)
    forgetting : float
        Weight of the past per sample.

    Returns
    -------
    Array, shape (samples, n)
        The estimate after every sample.
    """
    history = np.empty_like(regressors)
    for x, target, after in zip(regressors, targets, history, strict=True):
        gain = P @ x
        total = forgetting + x @ gain
        theta += gain / total * (target - x @ theta)
        P -= np.outer(gain, gain / total)
        P /= forgetting
        P[...] = 0.5 * (P + P.T)
        after[:] = theta
    return history


def fit_recursive_least_squares(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    forgetting: float = 1.0,
    bandwidth: float | None = None,
) -> FitResult:
    """Fit by recursive least squares, sample after sample.

    Parameters
    ----------
    model, maneuvers
        Model and data; entries must not be tied across equations.
    forgetting : float
        Weight of the past per sample, above 0 and at most 1; intervals are as wide as what it
        leaves.
    bandwidth : float, optional
        Bandwidth of the differentiation, Hz.
    """
    if not 0.0 < forgetting <= 1.0:
        raise IdentificationError(f"forgetting {forgetting}, expected above 0 and at most 1")
    names, equations = regression_equations(model, maneuvers, bandwidth=bandwidth)
    theta, wider = np.zeros(len(names)), np.ones(len(names))
    histories: list[Array] = []
    for equation in sorted({row.equation for row in equations}):
        mine = [row for row in equations if row.equation == equation]
        X = np.vstack([row.regressors for row in mine])
        y = np.concatenate([row.dependent for row in mine])
        active = np.flatnonzero(X.any(axis=0))
        if theta[active].any():
            raise IdentificationError(
                "recursive least squares takes one equation at a time, and this"
                " model ties entries of several: use recursive-fourier"
            )
        scale = np.sqrt(np.mean(X[:, active] ** 2, axis=0))
        estimate = np.zeros(len(active))
        P = START_VARIANCE * np.eye(len(active))
        history = update(estimate, P, np.ascontiguousarray(X[:, active] / scale), y, forgetting)
        full = np.zeros((len(history), len(names)))
        full[:, active] = history / scale
        histories.append(full)
        theta[active] = estimate / scale
        if forgetting < 1.0:
            wider[active] = _widened_by_forgetting(X[:, active] / scale, forgetting)
    batch = fit_equation_error(model, maneuvers, bandwidth=bandwidth)
    history = np.sum(histories, axis=0)
    result = _with_batch_statistics(
        batch, "recursive least squares", names, theta, history, _elapsed_s(maneuvers), equations
    )
    both = np.outer(wider, wider)
    # Samples of equal weight that would know as much.
    remembered = (1.0 + forgetting) / (1.0 - forgetting) if forgetting < 1.0 else np.inf
    return replace(
        result,
        covariance=both * result.covariance,
        covariance_white=both * result.covariance_white,
        degrees_of_freedom=np.minimum(result.degrees_of_freedom, remembered),
    )


def _widened_by_forgetting(regressors: Array, forgetting: float) -> Array:
    """Return the standard errors of an estimate that forgets over those of one that does not, (n,).

    With weights w of the samples the covariance is (X'wX)^-1 X'w^2X (X'wX)^-1 times the residuals'
    variance.
    """
    ages = np.arange(len(regressors))[::-1]
    weight = np.maximum(forgetting**ages, LEAST_WEIGHT)[:, None]
    inverse = covariance_from_information(regressors.T @ (weight * regressors))
    forgotten = inverse @ (regressors.T @ (weight**2 * regressors)) @ inverse
    whole = covariance_from_information(regressors.T @ regressors)
    return np.asarray(np.sqrt(np.diag(forgotten) / np.diag(whole)))


def _elapsed_s(maneuvers: Sequence[Maneuver]) -> Array:
    """Return the time of every sample, maneuvers one behind the other, s."""
    lengths = np.cumsum([0.0, *(m.samples * m.dt_s for m in maneuvers)])
    return np.concatenate([m.time_s + t for m, t in zip(maneuvers, lengths, strict=False)])


def fit_recursive_fourier(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    limits_hz: tuple[float, float] = (0.1, 2.0),
    every_s: float = 1.0,
) -> FitResult:
    """Fit by regression on recursive Fourier transforms, an estimate every second.

    Morelli, Real-time parameter estimation in the frequency domain, Journal of Guidance, Control
    and Dynamics 23 (2000).

    Rates need no differentiation: the transform of a rate is j w times that of the state. Trim
    and drift are kept out by the lowest frequency and by starting from the first sample.

    Parameters
    ----------
    model, maneuvers
        Model and one or several maneuvers; every state must be measured.
    limits_hz : tuple of float
        Band of the transforms.
    every_s : float
        Time between estimates, s.
    """
    count = len(model.parameters)
    f = np.arange(limits_hz[0], limits_hz[1] + 1e-9, SPACING_HZ)
    if len(f) < 4:
        raise IdentificationError(f"band {limits_hz} Hz holds {len(f)} lines, at least 4 needed")
    history: list[Array] = []
    history_s: list[float] = []
    begin_s = 0.0
    past_normal, past_right = np.zeros((count, count)), np.zeros(count)
    normal, right = past_normal, past_right
    whole: dict[int, list[tuple[Spectrum, Spectrum]]] = {}
    for maneuver in maneuvers:
        check_shapes(model, maneuver)
        last: dict[int, tuple[Spectrum, Spectrum]] = {}
        for time_s, last in _running_regressions(model, maneuver, f, every_s):
            normal = past_normal + sum((X.conj().T @ X).real for X, _ in last.values())
            right = past_right + sum((X.conj().T @ y).real for X, y in last.values())
            try:
                history.append(solve_normal_equations(normal, right))
            except IdentificationError:
                continue  # before the first input there is nothing to estimate
            history_s.append(begin_s + time_s)
        past_normal, past_right = normal, right
        begin_s += maneuver.samples * maneuver.dt_s
        for row, lines in last.items():
            whole.setdefault(row, []).append(lines)
    theta = solve_normal_equations(normal, right)
    batch = fit_equation_error(model, maneuvers)
    inverse = covariance_from_information(normal)
    covariance = batch.covariance.copy()
    covariance[:count, :count] = inverse @ _score_covariance(whole.values(), theta) @ inverse
    names, equations = regression_equations(model, maneuvers)
    full = batch.estimate.copy()
    full[:count] = theta
    result = _with_batch_statistics(
        batch,
        "recursive Fourier regression",
        names,
        full,
        np.array(history),
        np.array(history_s),
        equations,
    )
    return replace(result, covariance=covariance, covariance_white=covariance)


def _running_regressions(
    model: LinearModel, maneuver: Maneuver, f: Array, every_s: float
) -> Iterator[tuple[float, dict[int, tuple[Spectrum, Spectrum]]]]:
    """Yield times and, of each state's equation, regressors and rate transformed up to there."""
    measured = model.measured_states()
    entries = model.entries("AB")
    fixed = np.hstack([model.A, model.B])
    s = 2j * np.pi * f
    signals = np.hstack([maneuver.outputs[:, measured], maneuver.inputs])
    signals = signals - signals[0]
    time_s = maneuver.time_s
    running = maneuver.dt_s * np.cumsum(
        signals[:, None, :] * np.exp(-np.outer(time_s, s))[:, :, None], axis=0
    )
    hop = max(1, round(every_s / maneuver.dt_s))
    for k in [*range(hop - 1, maneuver.samples - 1, hop), maneuver.samples - 1]:
        z = running[k]
        end = np.exp(-s * time_s[k])[:, None] * signals[k, : len(measured)]
        yield (
            float(time_s[k]),
            {
                row: (
                    _regressors(entries, row, z, len(model.parameters)),
                    s * z[:, row] + end[:, row] - z @ fixed[row],
                )
                for row in sorted(set(entries.row.tolist()))
            },
        )


def _regressors(entries: EntryTable, row: int, z: Spectrum, count: int) -> Spectrum:
    """Return what each of `count` parameters multiplies in the equation of a state."""
    X: Spectrum = np.zeros((len(z), count), dtype=np.complex128)
    for t in np.flatnonzero(entries.row == row):
        X[:, entries.parameter[t]] += entries.gain[t] * z[:, entries.column[t]]
    return X


def _score_covariance(
    equations: Iterable[Sequence[tuple[Spectrum, Spectrum]]], theta: Array
) -> Array:
    """Return the covariance of the scores; each equation has residuals of a power of its own."""
    total: Array = np.zeros((len(theta), len(theta)))
    for parts in equations:
        power = float(np.mean([np.mean(np.abs(y - X @ theta) ** 2) for X, y in parts]))
        for X, _ in parts:
            total += (X.conj().T @ X).real * power
    return total


def _with_batch_statistics(
    batch: FitResult,
    method: str,
    names: tuple[str, ...],
    theta: Array,
    history: Array,
    history_s: Array,
    equations: list[RegressionEquation],
) -> FitResult:
    """Return a result with the residuals and covariance of the batch regression."""
    residuals = tuple(
        np.column_stack([row.residual(theta) for row in equations if row.maneuver == number])
        for number in range(len(batch.residuals))
    )
    fitted = tuple(
        np.column_stack([row.fitted(theta) for row in equations if row.maneuver == number])
        for number in range(len(batch.residuals))
    )
    return FitResult(
        method=method,
        model=batch.model,
        names=names,
        estimate=theta,
        covariance=batch.covariance,
        covariance_white=batch.covariance_white,
        degrees_of_freedom=batch.degrees_of_freedom,
        residuals=residuals,
        fitted=fitted,
        residual_kind="rate",
        noise_covariance=batch.noise_covariance,
        iterations=len(history),
        converged=True,
        details={"history": history, "history_s": history_s},
    )
