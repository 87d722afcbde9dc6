"""Fisher information and gradient of the likelihood of innovations, maneuver by maneuver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError
from host.sysid.numerics.filter_problem import FilterProblem, Likelihood

DIFFERENCE = 1e-5  # of a standard error (or of the size): step of the numeric slopes


def scoring(
    problem: FilterProblem, theta: Array, point: Likelihood, scale: Array
) -> tuple[list[Array], list[Array]]:
    """Return Fisher information and minus the cost's gradient of every maneuver.

    From one-sided differences: their width is 1e-5 standard errors. Biases and start values of a
    maneuver leave the gains as they are.
    """
    size = len(theta)
    slopes_e: list[dict[int, Array]] = []
    slopes_S: list[dict[int, Array]] = []
    for k in range(size):
        width = max(DIFFERENCE * scale[k], 1e-9 * (1.0 + abs(theta[k])))
        other = theta.copy()
        other[k] += width
        only = problem.owner(k)
        up = problem.evaluate(other, only, None if only is None else point, costless=True)
        if up is None:
            raise IdentificationError("filter error: the likelihood is not smooth at the estimate")
        runs = [number for number, e in enumerate(up.e) if len(e)]
        slopes_e.append({i: (up.e[i] - point.e[i]) / width for i in runs})
        slopes_S.append({i: (up.S[i] - point.S[i]) / width for i in runs})
    parts: list[Array] = []
    scores: list[Array] = []
    for number, (e, S) in enumerate(zip(point.e, point.S, strict=True)):
        information, gradient = np.zeros((size, size)), np.zeros(size)
        active = [k for k in range(size) if problem.owner(k) in (None, number)]
        moving = [k for k in active if np.any(slopes_S[k][number])]
        factor = np.linalg.cholesky(S)
        inner = np.linalg.inv(factor)
        white = inner @ e.T
        J = np.stack([(inner @ slopes_e[k][number].T).ravel() for k in active], axis=1)
        information[np.ix_(active, active)] += J.T @ J
        gradient[active] -= J.T @ white.ravel()
        outer = white @ white.T
        spread = {k: inner @ slopes_S[k][number] @ inner.T for k in moving}
        for a in moving:
            gradient[a] -= 0.5 * (len(e) * np.trace(spread[a]) - np.sum(spread[a] * outer))
        flat = np.array([spread[a].ravel() for a in moving])
        information[np.ix_(moving, moving)] += 0.5 * len(e) * (flat @ flat.T)
        parts.append(information)
        scores.append(gradient)
    return parts, scores


def summed(
    problem: FilterProblem, theta: Array, parts: Sequence[Array], scores: Sequence[Array]
) -> tuple[Array, Array]:
    """Return information and minus the cost's gradient of all maneuvers and the prior."""
    information, gradient = np.sum(parts, axis=0), np.sum(scores, axis=0)
    n = problem.n_model
    information[:n, :n] += np.diag(problem.inner.prior_precision)
    gradient[:n] -= problem.inner.prior_precision * (theta[:n] - problem.inner.prior_mean)
    return information, gradient
