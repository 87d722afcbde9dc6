"""Innovations of a steady-state Kalman filter as a function of every unknown of filter error.

Unknown are the model, biases, start states, the intensity of the process noise of chosen states and
the deviation of the noise of every output.
Jategaonkar, Flight Vehicle System Identification, 2nd ed., ch. 5; Klein & Morelli, ch. 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from host.compiled import Array
from host.sysid.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import LinearModel
from host.sysid.numerics.kernels import transition
from host.sysid.numerics.problem import OutputProblem
from host.sysid.numerics.riccati import innovations, predicted_covariance


@dataclass(slots=True)
class Likelihood:
    """Innovations (maneuvers, samples, p) and their covariance per maneuver's sample period."""

    e: list[Array]
    S: list[Array]
    cost: float
    gains: dict[float, tuple[Array, Array, Array]]


class FilterProblem:
    """Innovations as a function of parameters, log process and log measurement deviations."""

    def __init__(
        self, model: LinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...]
    ) -> None:
        if model.delays:
            raise IdentificationError(
                "filter error has no delays: estimate them by output error and shift the data"
            )
        strangers = [s for s in process if s not in model.states]
        if strangers:
            raise IdentificationError(
                f"process noise on {', '.join(strangers)}; states are {', '.join(model.states)}"
            )
        self.inner = OutputProblem(model, maneuvers)
        self.model = model
        self.maneuvers = tuple(maneuvers)
        self.process = process
        self.process_index = [model.states.index(s) for s in process]
        self.n_model = len(self.inner.names)
        self.names = (
            *self.inner.names,
            *(f"log_process.{s}" for s in process),
            *(f"log_noise.{y}" for y in model.outputs),
        )
        self._drives = []
        for maneuver in maneuvers:
            columns = [maneuver.inputs, np.ones((maneuver.samples, 1))]
            if model.hold == "foh":
                columns.append(np.diff(maneuver.inputs, axis=0, append=maneuver.inputs[-1:]))
            self._drives.append(np.ascontiguousarray(np.hstack(columns)))

    def owner(self, parameter: int) -> int | None:
        """Return the only maneuver a parameter acts on, None if it acts on all."""
        if self.inner.n_common <= parameter < self.n_model and self.inner.n_local:
            return (parameter - self.inner.n_common) // self.inner.n_local
        return None

    def evaluate(
        self,
        theta: Array,
        only: int | None = None,
        near: Likelihood | None = None,
        *,
        costless: bool = False,
    ) -> Likelihood | None:
        """Return innovations and cost; None where the filter or the model fails.

        Parameters
        ----------
        theta : Array
            All unknowns.
        only : int, optional
            Run this maneuver alone; the others give empty arrays.
        near : Likelihood, optional
            Of the same model: its gains are taken.
        costless : bool
            Leave the cost at zero.
        """
        model = self.model
        n, m = len(model.states), len(model.inputs)
        A, B, C, D = model.matrices(theta)
        AB = np.zeros((n, n + m + 1))
        AB[:, :n], AB[:, n : n + m] = A, B
        CD = np.ascontiguousarray(np.hstack([C, D]))
        split = self.n_model + len(self.process)
        with np.errstate(over="ignore"):
            intensity = np.zeros(n)
            intensity[self.process_index] = np.exp(2.0 * theta[self.n_model : split])
            R = np.diag(np.exp(2.0 * theta[split:]))
        if not (np.isfinite(intensity).all() and np.isfinite(R).all()):
            return None
        none = np.zeros(0, dtype=np.int64)
        cost = 0.0
        all_e: list[Array] = []
        all_S: list[Array] = []
        n_common = self.inner.n_common
        solutions = {} if near is None else near.gains
        for number, maneuver in enumerate(self.maneuvers):
            if only is not None and number != only:
                all_e.append(np.zeros((0, 0)))
                all_S.append(np.zeros((0, 0)))
                continue
            local = theta[self.inner.columns(number)]
            AB[:, -1] = 0.0
            position = n_common
            for state in model.state_biases:
                AB[model.states.index(state), -1] = local[position]
                position += 1
            bias = np.zeros(len(model.outputs))
            for output in model.output_biases:
                bias[model.outputs.index(output)] = local[position]
                position += 1
            start = np.zeros(n)
            for state in model.initial_states:
                start[model.states.index(state)] = local[position]
                position += 1
            step, _ = transition(
                AB, n, m, model.hold == "foh", maneuver.dt_s, none, none, none, np.zeros(0), 0
            )
            if maneuver.dt_s not in solutions:
                gain = self._gain(A, C, intensity, R, maneuver.dt_s)
                if gain is None:
                    return None
                solutions[maneuver.dt_s] = gain
            S, factor, K = solutions[maneuver.dt_s]
            finite, e = innovations(
                step, CD, K, self._drives[number], maneuver.outputs, start, bias
            )
            if not finite:
                return None
            all_e.append(e)
            all_S.append(S)
            if costless:
                continue
            white = linalg.solve_triangular(factor, e.T, lower=True)
            cost += 0.5 * float(np.sum(white**2))
            cost += len(e) * float(np.sum(np.log(np.diag(factor))))
        prior = self.inner.prior_precision
        miss = theta[: self.n_model] - self.inner.prior_mean
        cost += 0.5 * float(np.sum(prior * miss**2))
        return Likelihood(all_e, all_S, cost, solutions) if np.isfinite(cost) else None

    def _gain(
        self, A: Array, C: Array, intensity: Array, R: Array, dt_s: float
    ) -> tuple[Array, Array, Array] | None:
        """Return innovation covariance, its Cholesky factor and the steady Kalman gain."""
        F, Qd = discrete_noise(A, intensity, dt_s)
        if not np.isfinite(Qd).all() or np.max(np.abs(F)) > 1e6:
            return None
        try:
            solved, P = predicted_covariance(F, np.ascontiguousarray(C), Qd, R)
            S = C @ P @ C.T + R
            factor = np.linalg.cholesky(S)
        except np.linalg.LinAlgError:  # of the compiled solver as well
            return None
        if not solved:
            return None
        return S, factor, np.ascontiguousarray(np.linalg.solve(S, C @ P).T)


def discrete_noise(A: Array, intensity: Array, dt_s: float) -> tuple[Array, Array]:
    """Return the transition over a sample and the covariance white process noise adds in it.

    Exact: Van Loan, IEEE Transactions on Automatic Control 23 (1978), by the kernel that
    discretises. A trapezoid instead draws Cl_p 5 % off in rolling gusts at 50 Hz.

    Parameters
    ----------
    A : Array, shape (n, n)
    intensity : Array, shape (n,)
        Power of each state's noise per second.
    dt_s : float
    """
    n = len(A)
    block = np.zeros((2 * n, 2 * n + 1))
    block[:n, :n] = -A
    block[:n, n : 2 * n] = np.diag(intensity)
    block[n:, n : 2 * n] = A.T
    none = np.zeros(0, dtype=np.int64)
    E, _ = transition(block, 2 * n, 0, False, dt_s, none, none, none, np.zeros(0), 0)
    F = np.ascontiguousarray(E[n:, n : 2 * n].T)
    Qd = F @ np.ascontiguousarray(E[:n, n : 2 * n])
    return F, 0.5 * (Qd + Qd.T)
