"""Stepwise regression: model structure of each equation by significance of its terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.sysid.estimators.equation_error import fit_equation_error
from host.sysid.estimators.regression import RegressionEquation, regression_equations
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel

F_IN = 20.0  # sec. 5.4.1: far above the 95 % point, because model error is no white noise
GAIN_LIMIT = 0.005  # a term must also lift R2 by half a percent


def choose_terms(
    X: Array, y: Array, forced: BoolArray, *, f_in: float = F_IN, gain: float = GAIN_LIMIT
) -> list[int]:
    """Return the columns of X that are significant.

    A term enters if its partial F, (RSS_without - RSS_with) / s^2, exceeds the limit, and leaves if
    it falls below (Klein & Morelli, Aircraft System Identification, sec. 5.4).

    Parameters
    ----------
    X : Array, shape (samples, candidates)
    y : Array, shape (samples,)
    forced : Array of bool, shape (candidates,)
        Columns that are always in the model (bias).
    f_in : float
        Partial F to enter and to stay.
    gain : float
        Least increase of R2 by a term.
    """
    selected = [int(k) for k in np.flatnonzero(forced)]
    total = float(np.sum((y - (y.mean() if selected else 0.0)) ** 2))
    for _ in range(4 * X.shape[1]):
        rss = _rss(X[:, selected], y)
        best, best_f, best_rss = _best_to_enter(X, y, selected, rss)
        if best < 0 or best_f < f_in or (rss - best_rss) < gain * total:
            break
        selected.append(best)
        for k in [c for c in selected if not forced[c]]:
            rest = [c for c in selected if c != k]
            now, without = _rss(X[:, selected], y), _rss(X[:, rest], y)
            f = (without - now) / max(now / max(len(y) - len(selected), 1), 1e-300)
            if f < f_in:
                selected = rest
    return sorted(selected)


def _best_to_enter(
    X: Array, y: Array, selected: Sequence[int], rss: float
) -> tuple[int, float, float]:
    """Return the regressor of the largest partial F given those selected, F and what it leaves.

    It is -1 where none leaves less.
    """
    best, best_f, best_rss = -1, 0.0, rss
    for k in range(X.shape[1]):
        if k in selected or not X[:, k].any():
            continue
        trial = _rss(X[:, [*selected, k]], y)
        f = (rss - trial) / max(trial / max(len(y) - len(selected) - 1, 1), 1e-300)
        if f > best_f:
            best, best_f, best_rss = k, f, trial
    return best, best_f, best_rss


def fit_stepwise(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    f_in: float = F_IN,
    bandwidth: float | None = None,
) -> FitResult:
    """Choose the terms of each equation, then fit them by equation error.

    Parameters
    ----------
    model, maneuvers
        Candidates are the free entries of the model.
    f_in : float
        Partial F to enter and to stay.
    bandwidth : float, optional
        Bandwidth of the differentiation, Hz.

    Returns
    -------
    FitResult
        Dropped parameters are zero with zero variance and named in a warning; the others have the
        covariance of the selected structure.
    """
    names, equations = regression_equations(model, maneuvers, bandwidth=bandwidth)
    retained = _retained(names, equations, f_in)
    dropped = [p.name for p in model.parameters if p.name not in retained]
    if not retained & {p.name for p in model.parameters}:
        raise IdentificationError(
            "no term of the model is significant: these data hold nothing of this aircraft"
        )
    smaller = replace(
        model,
        terms=tuple(t for t in model.terms if t.parameter in retained),
        parameters=tuple(p for p in model.parameters if p.name in retained),
    )
    result = fit_equation_error(smaller, maneuvers, bandwidth=bandwidth)
    at = np.zeros((len(names), len(result.names)))  # where each parameter stands among all
    at[[names.index(name) for name in result.names], range(len(result.names))] = 1.0
    warnings = result.warnings
    if dropped:
        warnings = (*warnings, f"not significant, set to zero: {', '.join(dropped)}")
    return replace(
        result,
        method="stepwise regression",
        model=model,
        names=names,
        estimate=at @ result.estimate,
        covariance=at @ result.covariance @ at.T,
        covariance_white=at @ result.covariance_white @ at.T,
        degrees_of_freedom=np.full(len(names), float(result.degrees_of_freedom[0])),
        warnings=warnings,
        details={"kept": float(len(smaller.parameters))},
    )


def _retained(
    names: Sequence[str], equations: Sequence[RegressionEquation], f_in: float
) -> set[str]:
    """Return the parameters of the terms that stay in some equation."""
    retained: set[str] = set()
    for equation in {block.equation for block in equations}:
        own = [block for block in equations if block.equation == equation]
        X = np.vstack([block.regressors for block in own])
        y = np.concatenate([block.dependent for block in own])
        forced = np.array([name.startswith("bias") for name in names]) & X.any(axis=0)
        retained |= {names[k] for k in choose_terms(X, y, forced, f_in=f_in)}
    return retained


def _rss(X: Array, y: Array) -> float:
    if X.shape[1] == 0:
        return float(y @ y)
    scale = np.sqrt(np.sum(X**2, axis=0))
    solution, _, _, _ = np.linalg.lstsq(np.asarray(X / scale, dtype=np.float64), y, rcond=1e-12)
    residual = y - (X / scale) @ solution
    return float(residual @ residual)
