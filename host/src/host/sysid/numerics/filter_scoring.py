"""Fisher information and gradient of the likelihood of innovations, per maneuver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.identification_error import IdentificationError
from host.sysid.numerics.filter_problem import (
    FilterProblem,
    InnovationLikelihood,
    SteadyStateFilter,
)
from host.sysid.numerics.filter_sensitivities import (
    GainSensitivities,
    gain_sensitivities,
    intermittent_columns,
    intermittent_innovations,
    maneuver_sensitivities,
    matrix_sensitivities,
)
from host.sysid.numerics.intermittent_filter import IntermittentInnovations
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
    size = len(theta)
    matrices = matrix_sensitivities(problem.model, theta)
    gains = _gain_sensitivities(problem, theta, point, matrices)
    parts: list[Array] = []
    scores: list[Array] = []
    for number, maneuver in enumerate(problem.maneuvers):
        gain, by = point.gains[maneuver.dt_s], gains[maneuver.dt_s]
        active = _active(problem, number)
        if point.intermittent[number] is not None:
            information, gradient = _intermittent_scoring(problem, theta, number, gain, by)
            parts.append(information)
            scores.append(gradient)
            continue
        J = _innovation_sensitivities(problem, theta, point, number, by, matrices)
        white = point.e[number] @ gain.whitener.T
        information, gradient = np.zeros((size, size)), np.zeros(size)
        information[np.ix_(active, active)] = J.T @ J
        gradient[active] = -(J.T @ white.ravel())
        # The gain depends only on the unknowns that all maneuvers share.
        shared = _shared(problem)
        spread = gain.whitener @ by.S @ gain.whitener.T
        trace = np.trace(spread, axis1=1, axis2=2)
        outer = white.T @ white
        gradient[shared] -= 0.5 * (len(white) * trace - np.sum(spread * outer, axis=(1, 2)))
        flat = spread.reshape(len(shared), -1)
        information[np.ix_(shared, shared)] += 0.5 * len(white) * (flat @ flat.T)
        parts.append(information)
        scores.append(gradient)
    return parts, scores


def whitened_innovation_sensitivities(
    problem: FilterProblem, theta: Array, point: InnovationLikelihood
) -> list[Array]:
    """Return sensitivities of the whitened innovations of every maneuver, (samples, p, P)."""
    matrices = matrix_sensitivities(problem.model, theta)
    gains = _gain_sensitivities(problem, theta, point, matrices)
    found: list[Array] = []
    for number, (e, maneuver) in enumerate(zip(point.e, problem.maneuvers, strict=True)):
        slopes = np.zeros((e.size, len(theta)))
        gain, by = point.gains[maneuver.dt_s], gains[maneuver.dt_s]
        if point.intermittent[number] is not None:
            run, columns = _intermittent(problem, theta, number, gain, by)
            slopes[:, columns] = run.by_independent.reshape(e.size, -1)
        else:
            slopes[:, _active(problem, number)] = _innovation_sensitivities(
                problem, theta, point, number, by, matrices
            )
        found.append(slopes.reshape(*e.shape, -1))
    return found


def _gain_sensitivities(
    problem: FilterProblem,
    theta: Array,
    point: InnovationLikelihood,
    matrices: tuple[Array, Array, Array],
) -> dict[float, GainSensitivities]:
    AB_slopes, _, CD_slopes = matrices
    rows_known: dict[int, GainSensitivities] = {}
    for dt_s, gain in point.gains.items():
        if id(gain) not in rows_known:
            rows_known[id(gain)] = gain_sensitivities(
                problem, theta, gain, dt_s, AB_slopes, CD_slopes
            )
    return {dt_s: rows_known[id(gain)] for dt_s, gain in point.gains.items()}


def _active(problem: FilterProblem, number: int) -> IntArray:
    """Return which unknowns the innovations of a maneuver depend on."""
    noise = np.arange(problem.n_model, len(problem.names))
    return np.concatenate([problem.output_problem.columns(number), noise])


def _shared(problem: FilterProblem) -> IntArray:
    return np.concatenate(
        [np.arange(problem.output_problem.n_common), np.arange(problem.n_model, len(problem.names))]
    )


def _intermittent(
    problem: FilterProblem,
    theta: Array,
    number: int,
    gain: SteadyStateFilter,
    by: GainSensitivities,
) -> tuple[IntermittentInnovations, IntArray]:
    """Return innovations of a maneuver with missing outputs, and which unknowns their slopes are
    by."""
    run = intermittent_innovations(problem, theta, number, gain, by)
    if run is None:  # it ran at this very point without slopes
        raise IdentificationError(f"model {problem.model.name}: the Kalman filter has no slopes")
    outputs, active = problem.output_problem, _active(problem, number)
    return run, active[intermittent_columns(outputs.n_common, outputs.n_local, len(active))]


def _intermittent_scoring(
    problem: FilterProblem,
    theta: Array,
    number: int,
    gain: SteadyStateFilter,
    by: GainSensitivities,
) -> tuple[Array, Array]:
    """Return information and negative gradient of a maneuver with missing outputs.

    Of an innovation w of variance s, given those before, the information is dw dw / s + ds ds /
    (2 s^2).
    """
    run, columns = _intermittent(problem, theta, number, gain, by)
    white = run.white.ravel()
    J = run.by_independent.reshape(white.size, -1)
    spread = run.by_variance.reshape(white.size, -1)
    shared = columns[: spread.shape[1]]
    information, gradient = np.zeros((len(theta), len(theta))), np.zeros(len(theta))
    information[np.ix_(columns, columns)] = J.T @ J
    information[np.ix_(shared, shared)] += 0.5 * spread.T @ spread
    gradient[columns] = -(J.T @ white)
    gradient[shared] -= 0.5 * spread.T @ (1.0 - white**2)
    return information, gradient


def _innovation_sensitivities(
    problem: FilterProblem,
    theta: Array,
    point: InnovationLikelihood,
    number: int,
    by: GainSensitivities,
    matrices: tuple[Array, Array, Array],
) -> Array:
    """Return sensitivities of the whitened innovations, (samples x p, `_active`)."""
    _, CD, CD_slopes = matrices
    model, output_problem = problem.model, problem.output_problem
    n, p = len(model.states), len(model.outputs)
    gain: SteadyStateFilter = point.gains[problem.maneuvers[number].dt_s]
    common, local = output_problem.n_common, output_problem.n_local
    width = common + local + len(theta) - problem.n_model
    noise = slice(common + local, width)
    one = maneuver_sensitivities(problem, theta, number, CD_slopes)
    step_slopes, direct = one.by_step, one.direct
    w, rows_known = one.step.shape[1] - n, step_slopes.shape[2]
    drive = np.zeros((n + w + p, n, width))
    drive[: n + w, :, :rows_known] = step_slopes.transpose(1, 0, 2)
    FK = gain.F @ gain.K
    drive[: n + w] -= FK @ direct
    drive[n + w :, :, :common] = np.einsum("iaq,aj->jiq", step_slopes[:, :n, :common], gain.K)
    for part, own in ((slice(0, common), slice(0, common)), (noise, slice(common, None))):
        drive[n + w :, :, part] += np.einsum("ia,qaj->jiq", gain.F, by.K[own])
    z = point.z[number]
    out = np.empty((p, len(z), width))
    whitened_C = gain.whitener @ CD[:, :n]
    propagate(gain.F - FK @ CD[:, :n], drive.transpose(1, 0, 2), z, whitened_C, one.start, out)
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
