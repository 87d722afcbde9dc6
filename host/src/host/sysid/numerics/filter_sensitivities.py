"""Exact sensitivities of a steady-state Kalman filter to the model and to both kinds of noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.numerics.discretisation import discretise
from host.sysid.numerics.innovation_problem import InnovationProblem
from host.sysid.numerics.process_noise import halvings_of, van_loan
from host.sysid.numerics.riccati import SteadyStateFilter


@dataclass(frozen=True, slots=True)
class GainSensitivities:
    """Derivatives of S (shared, p, p), K (shared, n, p), P and Q (shared, n, n) by the unknowns all
    maneuvers share."""

    S: Array
    K: Array
    P: Array
    Q: Array


def gain_sensitivities(
    problem: InnovationProblem,
    theta: Array,
    gain: SteadyStateFilter,
    dt_s: float,
    C_slopes: Array,
) -> GainSensitivities:
    """Return derivatives of the filter at one sample period; `C_slopes` (p, n, common) of C.

    The Riccati equation in Joseph's form, P = F (I - K C) P (I - K C)' F' + F K R K' F' + Q, does
    not depend on the gain to first order. The derivative of P therefore obeys the Lyapunov equation
    dP = A_c dP A_c' + X with A_c = F (I - K C), one for all unknowns (EQUATIONS.md, eq. 33).
    """
    A, _, C, _ = problem.model.matrices(theta)
    n, p = len(A), len(C)
    common, process = problem.output_problem.n_common, len(problem.process)
    count = common + process + p
    intensity, power = problem.noise(theta)
    F, Q = _noise_sensitivities(problem, A, intensity, dt_s)
    dC = np.zeros((count, p, n))
    dC[:common] = C_slopes.transpose(2, 0, 1)
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


def _noise_sensitivities(
    problem: InnovationProblem, A: Array, intensity: Array, dt_s: float
) -> tuple[Array, Array]:
    """Return derivatives of F and Q of a sample, each (common and process, n, n)."""
    n, halvings = len(A), halvings_of(A, dt_s)
    entries, common = problem.model.entries("AB"), problem.output_problem.n_common
    own = entries.column < n
    row, column, parameter = entries.row[own], entries.column[own], entries.parameter[own]
    gain, driven_states = entries.gain[own], np.array(problem.process_index, dtype=np.int64)
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
