"""Exact sensitivities of a steady-state Kalman filter to the model and to both kinds of noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.filter_problem import FilterProblem, SteadyStateFilter
from host.sysid.numerics.process_noise import halvings_of, van_loan


@dataclass(frozen=True, slots=True)
class GainSensitivities:
    """Derivatives of S (shared, p, p), K (shared, n, p), P and Q (shared, n, n) by the unknowns all
    maneuvers share."""

    S: Array
    K: Array
    P: Array
    Q: Array


@dataclass(frozen=True, slots=True)
class ManeuverSensitivities:
    """One sample of a maneuver by its unknowns: common, its constants, both kinds of noise.

    Attributes
    ----------
    step : Array, shape (n, n + w)
        [Phi Gamma].
    by_step : Array, shape (n, n + w, known)
        Its derivatives; none by the unknowns behind the rates.
    direct : Array, shape (n + w, p, columns)
        Derivatives of the outputs at a fixed state, by state and drive.
    start : Array, shape (n, columns)
        Of the initial state.
    """

    step: Array
    by_step: Array
    direct: Array
    start: Array


def matrix_sensitivities(model: LinearModel, theta: Array) -> tuple[Array, Array, Array]:
    """Return derivatives of [A B], then [C D] itself and its derivatives.

    The last axis of a derivative counts the common parameters.
    """
    A, B, C, D = model.matrices(theta)
    names = [p.name for p in model.parameters]
    AB, CD = (
        np.stack([np.hstack([model.gradient(x, name) for x in pair]) for name in names], axis=2)
        for pair in ("AB", "CD")
    )
    for lever in model.accelerometer_offsets:
        # The offset adds a whole state equation to an output.
        row, state = model.outputs.index(lever.output), model.states.index(lever.state)
        arm = names.index(lever.parameter)
        CD[row] += lever.gain * theta[arm] * AB[state]
        CD[row, :, arm] += lever.gain * np.concatenate([A[state], B[state]])
    return AB, np.hstack([C, D]), CD


def gain_sensitivities(
    problem: FilterProblem,
    theta: Array,
    gain: SteadyStateFilter,
    dt_s: float,
    AB_slopes: Array,
    CD_slopes: Array,
) -> GainSensitivities:
    """Return derivatives of the filter at one sample period.

    The Riccati equation in Joseph's form, P = F (I - K C) P (I - K C)' F' + F K R K' F' + Q, does
    not depend on the gain to first order. The derivative of P therefore obeys the Lyapunov equation
    dP = A_c dP A_c' + X with A_c = F (I - K C), one for all unknowns (EQUATIONS.md, eq. 33).
    """
    A, _, C, _ = problem.model.matrices(theta)
    n, p = len(A), len(C)
    common, process = problem.output_problem.n_common, len(problem.process)
    count = common + process + p
    intensity, power = problem.noise(theta)
    F, Q = _noise_sensitivities(problem, A, intensity, dt_s, AB_slopes[:, :n])
    dC = np.zeros((count, p, n))
    dC[:common] = CD_slopes[:, :n].transpose(2, 0, 1)
    dR = np.zeros((count, p, p))
    dR[common + process + np.arange(p), np.arange(p), np.arange(p)] = 2.0 * power
    dF, dQ = np.zeros((2, count, n, n))
    dF[: common + process], dQ[: common + process] = F, Q
    reduction = np.eye(n) - gain.K @ C
    updated = reduction @ gain.P  # covariance after the measurement update
    closed = gain.F @ reduction
    change = dF @ updated @ gain.F.T - closed @ gain.P @ dC.transpose(0, 2, 1) @ gain.K.T @ gain.F.T
    change = change + change.transpose(0, 2, 1)
    change += dQ + gain.F @ gain.K @ dR @ gain.K.T @ gain.F.T
    system = np.eye(n * n) - np.kron(closed, closed)
    dP = np.linalg.solve(system, change.reshape(count, n * n).T).T.reshape(count, n, n)
    across = dC @ gain.P @ C.T
    dS = across + across.transpose(0, 2, 1) + C @ dP @ C.T + dR
    inverse = gain.whitener.T @ gain.whitener
    dK = (dP @ C.T + gain.P @ dC.transpose(0, 2, 1) - gain.K @ dS) @ inverse
    return GainSensitivities(dS, dK, dP, dQ)


def maneuver_sensitivities(
    problem: FilterProblem, theta: Array, number: int, CD_slopes: Array
) -> ManeuverSensitivities:
    """Return what one sample of a maneuver depends on; `CD_slopes` as `matrix_sensitivities`."""
    model, outputs = problem.model, problem.output_problem
    n, m, p = len(model.states), len(model.inputs), len(model.outputs)
    common = outputs.n_common
    width = common + outputs.n_local + len(theta) - problem.n_model
    A, B, _, _ = model.matrices(theta)
    rate, _, _ = problem.constants(theta, number)
    entries = model.entries("AB")
    rates = np.array([model.states.index(s) for s in model.state_biases], dtype=np.int64)
    step, by_step = discretise(
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
    rows_known = common + len(rates)
    direct = np.zeros((step.shape[1], p, width))
    direct[: n + m, :, :common] = CD_slopes.transpose(1, 0, 2)
    for k, output in enumerate(model.output_biases):
        direct[n + m, model.outputs.index(output), rows_known + k] = 1.0
    start = np.zeros((n, width))
    for k, state in enumerate(model.initial_states):
        start[model.states.index(state), rows_known + len(model.output_biases) + k] = 1.0
    for state, name in model.shared_starts:
        start[model.states.index(state), problem.names.index(name)] = 1.0
    return ManeuverSensitivities(step, by_step, direct, start)


def _noise_sensitivities(
    problem: FilterProblem, A: Array, intensity: Array, dt_s: float, A_slopes: Array
) -> tuple[Array, Array]:
    """Return derivatives of F and Q of a sample, each (common and process, n, n)."""
    n, halvings = len(A), halvings_of(A, dt_s)
    row, column, parameter = np.nonzero(A_slopes)
    gain = A_slopes[row, column, parameter]
    driven_states = np.array(problem.process_index, dtype=np.int64)
    common = A_slopes.shape[2]
    E, slopes = discretise(
        van_loan(A, intensity),
        2 * n,
        0,
        False,
        dt_s / 2.0**halvings,
        np.concatenate([row, n + column, driven_states]),
        np.concatenate([column, n + row, n + driven_states]),
        np.concatenate([parameter, parameter, common + np.arange(len(driven_states))]),
        np.concatenate([-gain, gain, 2.0 * intensity[driven_states]]),
        common + len(driven_states),
    )
    slopes = slopes.transpose(2, 0, 1)
    F, dF = E[n:, n : 2 * n].T, slopes[:, n:, n : 2 * n].transpose(0, 2, 1)
    Q, dQ = F @ E[:n, n : 2 * n], dF @ E[:n, n : 2 * n] + F @ slopes[:, :n, n : 2 * n]
    for _ in range(halvings):
        one_side = dF @ (Q @ F.T)
        dQ = dQ + one_side + one_side.transpose(0, 2, 1) + F @ dQ @ F.T
        Q, dF, F = Q + F @ Q @ F.T, dF @ F + F @ dF, F @ F
    return dF, 0.5 * (dQ + dQ.transpose(0, 2, 1))
