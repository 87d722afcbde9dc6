"""Fisher information and gradient of the likelihood of innovations, per maneuver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.filter_problem import (
    FilterProblem,
    InnovationLikelihood,
    SteadyStateFilter,
)
from host.sysid.numerics.filter_sensitivities import (
    GainSensitivities,
    gain_sensitivities,
    matrix_sensitivities,
)
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
        slopes[:, _active(problem, number)] = _innovation_sensitivities(
            problem, theta, point, number, gains[maneuver.dt_s], matrices
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
    n, m, p = len(model.states), len(model.inputs), len(model.outputs)
    gain: SteadyStateFilter = point.gains[problem.maneuvers[number].dt_s]
    common, local = output_problem.n_common, output_problem.n_local
    width = common + local + len(theta) - problem.n_model
    noise = slice(common + local, width)
    A, B, _, _ = model.matrices(theta)
    rate, _, _ = problem.constants(theta, number)
    entries = model.entries("AB")
    rates = np.array([model.states.index(s) for s in model.state_biases], dtype=np.int64)
    step, step_slopes = discretise(
        np.column_stack([A, B, rate]),
        n,
        m,
        model.hold == "foh",
        problem.maneuvers[number].dt_s,
        np.concatenate([entries.row, rates]),
        np.concatenate([entries.column, np.full(len(rates), n + m)]),
        np.concatenate([entries.parameter, common + np.arange(len(rates))]),
        np.concatenate([entries.gain, np.ones(len(rates))]),
        common + len(rates),
    )
    w = step.shape[1] - n
    rows_known = common + len(rates)
    direct = np.zeros((n + w, p, width))
    direct[: n + m, :, :common] = CD_slopes.transpose(1, 0, 2)
    for k, output in enumerate(model.output_biases):
        direct[n + m, model.outputs.index(output), rows_known + k] = 1.0
    start = np.zeros((n, width))
    for k, state in enumerate(model.initial_states):
        start[model.states.index(state), rows_known + len(model.output_biases) + k] = 1.0
    for state, name in model.shared_starts:
        start[model.states.index(state), problem.names.index(name)] = 1.0
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
    propagate(gain.F - FK @ CD[:, :n], drive.transpose(1, 0, 2), z, whitened_C, start, out)
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
