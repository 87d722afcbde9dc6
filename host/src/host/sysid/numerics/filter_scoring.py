"""Fisher information and gradient of the likelihood of innovations, per maneuver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.filter_problem import FilterProblem, InnovationLikelihood
from host.sysid.numerics.filter_sensitivities import GainSensitivities, gain_sensitivities
from host.sysid.numerics.intermittent_scoring import intermittent_scoring, intermittent_slopes
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.recursion import propagate


def fisher_scoring(
    problem: FilterProblem, theta: Array, point: InnovationLikelihood
) -> tuple[list[Array], list[Array]]:
    """Return Fisher information and negative gradient of the cost, per maneuver.

    With innovations nu of covariance S over N samples, M_ij = sum (d nu/d i)' S^-1 (d nu/d j) + N/2
    tr(S^-1 dS/di S^-1 dS/dj); the gradient has the same two parts (EQUATIONS.md, eq. 32).

    Parameters
    ----------
    problem : FilterProblem
    theta : Array
        All unknowns.
    point : InnovationLikelihood
        At `theta`.

    Returns
    -------
    list of Array, shape (P, P)
        Information of every maneuver, without the prior.
    list of Array, shape (P,)
        Negative gradients.
    """
    gains = _gain_sensitivities(problem, theta, point)
    found = [
        _steady_scoring(problem, theta, point, number, by)
        if point.intermittent[number] is None
        else intermittent_scoring(problem, theta, number, point.filters[number], by)
        for number, by in enumerate(gains)
    ]
    return [information for information, _ in found], [gradient for _, gradient in found]


def _steady_scoring(
    problem: FilterProblem,
    theta: Array,
    point: InnovationLikelihood,
    number: int,
    by: GainSensitivities,
) -> tuple[Array, Array]:
    """Return information and negative gradient of a maneuver that is measured at every sample."""
    steady, active = point.filters[number], problem.columns(number)
    J = _innovation_sensitivities(problem, theta, point, number, by)
    white = point.e[number] @ steady.whitener.T
    information, gradient = np.zeros((len(theta), len(theta))), np.zeros(len(theta))
    information[np.ix_(active, active)] = J.T @ J
    gradient[active] = -(J.T @ white.ravel())
    # The gain depends only on the unknowns that all maneuvers share.
    shared = _shared(problem)
    spread = steady.whitener @ by.S @ steady.whitener.T
    trace = np.trace(spread, axis1=1, axis2=2)
    outer = white.T @ white
    gradient[shared] -= 0.5 * (len(white) * trace - np.sum(spread * outer, axis=(1, 2)))
    flat = spread.reshape(len(shared), -1)
    information[np.ix_(shared, shared)] += 0.5 * len(white) * (flat @ flat.T)
    return information, gradient


def whitened_innovation_sensitivities(
    problem: FilterProblem, theta: Array, point: InnovationLikelihood
) -> list[Array]:
    """Return sensitivities of the whitened innovations of every maneuver, (samples, p, P)."""
    gains = _gain_sensitivities(problem, theta, point)
    found: list[Array] = []
    for number, (e, by) in enumerate(zip(point.e, gains, strict=True)):
        slopes = np.zeros((e.size, len(theta)))
        if point.intermittent[number] is not None:
            run, columns = intermittent_slopes(problem, theta, number, point.filters[number], by)
            slopes[:, columns] = run.by_independent.reshape(e.size, -1)
        else:
            slopes[:, problem.columns(number)] = _innovation_sensitivities(
                problem, theta, point, number, by
            )
        found.append(slopes.reshape(*e.shape, -1))
    return found


def _gain_sensitivities(
    problem: FilterProblem, theta: Array, point: InnovationLikelihood
) -> list[GainSensitivities]:
    """Return those of every maneuver's filter, found once for each sample period."""
    of_period: dict[float, GainSensitivities] = {}
    n, common = len(problem.model.states), problem.output_problem.n_common
    for number, (period_s, steady) in enumerate(zip(problem.periods_s, point.filters, strict=True)):
        if period_s not in of_period:
            C_slopes = problem.sampled(number, theta).by_read[:, :n, :common]
            of_period[period_s] = gain_sensitivities(problem, theta, steady, period_s, C_slopes)
    return [of_period[period_s] for period_s in problem.periods_s]


def _shared(problem: FilterProblem) -> IntArray:
    return np.concatenate(
        [np.arange(problem.output_problem.n_common), np.arange(problem.n_model, len(problem.names))]
    )


def _innovation_sensitivities(
    problem: FilterProblem,
    theta: Array,
    point: InnovationLikelihood,
    number: int,
    by: GainSensitivities,
) -> Array:
    """Return sensitivities of the whitened innovations, (samples x p, own columns)."""
    n, p = len(problem.model.states), len(problem.model.outputs)
    gain, common = point.filters[number], problem.output_problem.n_common
    one = problem.sampled(number, theta)
    direct = one.by_read.transpose(1, 0, 2)
    w, width = one.step.shape[1] - n, one.by_start.shape[1]
    noise = slice(common + problem.output_problem.n_local, width)
    drive = np.zeros((n + w + p, n, width))
    FK = gain.F @ gain.K
    drive[: n + w] = one.by_step.transpose(1, 0, 2) - FK @ direct
    drive[n + w :, :, :common] = np.einsum("iaq,aj->jiq", one.by_step[:, :n, :common], gain.K)
    for part, own in ((slice(0, common), slice(0, common)), (noise, slice(common, None))):
        drive[n + w :, :, part] += np.einsum("ia,qaj->jiq", gain.F, by.K[own])
    z = point.z[number]
    out = np.empty((p, len(z), width))
    whitened_C = gain.whitener @ one.C
    propagate(gain.F - FK @ one.C, drive.transpose(1, 0, 2), z, whitened_C, one.by_start, out)
    # Direct part at a fixed state; the rest comes through the state.
    known_state = -(gain.whitener @ direct).reshape(n + w, -1)
    slopes = (z[:, : n + w] @ known_state).reshape(len(z), p, width)
    slopes -= out.transpose(1, 0, 2)
    return np.asarray(slopes.reshape(-1, width))


def total_information(
    outputs: OutputProblem, theta: Array, parts: Sequence[Array], scores: Sequence[Array]
) -> tuple[Array, Array]:
    """Return information and negative gradient of the cost, all maneuvers and the prior summed."""
    information, gradient = np.sum(parts, axis=0), np.sum(scores, axis=0)
    n = len(outputs.names)
    information[:n, :n] += np.diag(outputs.prior_precision)
    gradient[:n] -= outputs.prior_precision * (theta[:n] - outputs.prior_mean)
    return information, gradient
