"""Filter error: maximum likelihood with process noise (turbulence) and measurement noise.

Innovations of a steady-state Kalman filter are the residuals. Unknown are the model, biases, start
states, the intensity of the process noise of chosen states and the deviation of the noise of every
output; the search is Fisher scoring on the exact Gaussian likelihood of the innovations.
Jategaonkar, Flight Vehicle System Identification, 2nd ed., ch. 5; Klein & Morelli, ch. 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from host.compiled import Array, BoolArray
from host.sysid.errors import IdentificationError
from host.sysid.estimators.start import start_values
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import LinearModel
from host.sysid.models.result import FitResult
from host.sysid.numerics.inverse import covariance_of
from host.sysid.numerics.kernels import transition
from host.sysid.numerics.output_error import minimise
from host.sysid.numerics.problem import OutputProblem
from host.sysid.numerics.repeats import pulls
from host.sysid.numerics.riccati import innovations, predicted_covariance

STEP_LIMIT = 0.01
MAX_ITERATIONS = 60
DIFFERENCE = 1e-5  # of a standard error (or of the size): step of the numeric slopes
NOISE_FLOOR = 1e-3  # of an output's deviation: an attitude filter's smoothness is not exactness
NOISE_SHARE = (0.3, 0.7)  # first guess: process noise explains the first part of residual power


@dataclass(slots=True)
class _Likelihood:
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
        near: _Likelihood | None = None,
        *,
        costless: bool = False,
    ) -> _Likelihood | None:
        """Return innovations and cost; None where the filter or the model fails.

        Parameters
        ----------
        theta : Array
            All unknowns.
        only : int, optional
            Run this maneuver alone; the others give empty arrays.
        near : _Likelihood, optional
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
        return _Likelihood(all_e, all_S, cost, solutions) if np.isfinite(cost) else None

    def _gain(
        self, A: Array, C: Array, intensity: Array, R: Array, dt_s: float
    ) -> tuple[Array, Array, Array] | None:
        """Return innovation covariance, its Cholesky factor and the steady Kalman gain."""
        F, Qd = discrete_noise(A, intensity, dt_s)
        if not np.isfinite(Qd).all() or np.max(np.abs(F)) > 1e6:
            return None
        solved, P = predicted_covariance(F, np.ascontiguousarray(C), Qd, R)
        if not solved:
            return None
        S = C @ P @ C.T + R
        try:
            factor = np.linalg.cholesky(S)
        except np.linalg.LinAlgError:
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


def fit_filter_error(
    model: LinearModel,
    maneuvers: Sequence[Maneuver],
    *,
    process: tuple[str, ...] | None = None,
    start: Array | None = None,
) -> FitResult:
    """Fit by filter error.

    Parameters
    ----------
    model, maneuvers
        Model and data. A gust can be a state of its own, its entries tied to those of alpha.
    process : tuple of str, optional
        States driven by white process noise; without, all whose rate has a free entry.
    start : Array, optional
        Start of the model's own vector; output error gives it without.

    Raises
    ------
    IdentificationError
        If no start is finite.
    """
    if process is None:
        rows = {t.row for t in model.terms if t.matrix == "A"}
        process = tuple(model.states[i] for i in sorted(rows))
    problem = FilterProblem(model, maneuvers, process)
    first = start_values(problem.inner) if start is None else np.asarray(start, dtype=np.float64)
    theta, scale = _first_guess(problem, first, fit_first=start is None)
    point = problem.evaluate(theta)
    if point is None:
        raise IdentificationError(f"model {model.name}: the Kalman filter fails at the start")
    floor = np.log(
        NOISE_FLOOR * np.maximum(np.std(np.vstack([m.outputs for m in maneuvers]), axis=0), 1e-9)
    )
    split = problem.n_model + len(process)
    damping, converged, iterations, size = 0.0, False, 0, np.inf
    parts, scores = _scoring(problem, theta, point, scale)
    information, gradient = _summed(problem, theta, parts, scores)
    while iterations < MAX_ITERATIONS:
        held = np.zeros(len(theta), dtype=bool)
        held[split:] = (theta[split:] <= floor) & (gradient[split:] < 0.0)
        held[: problem.n_model] = ~_free(problem.inner, theta, gradient)
        step, size, bound = _step(information, gradient, damping, ~held)
        limited = step.copy()
        limited[problem.n_model :] = np.clip(limited[problem.n_model :], -1.5, 1.5)
        trial_theta = theta + limited
        trial_theta[: problem.n_model] = np.clip(
            trial_theta[: problem.n_model], problem.inner.lower, problem.inner.upper
        )
        trial_theta[split:] = np.maximum(trial_theta[split:], floor)
        trial = problem.evaluate(trial_theta)
        if trial is None or trial.cost > point.cost + 1e-9 * abs(point.cost):
            if size < STEP_LIMIT:
                converged = True
                break
            damping = max(4.0 * damping, 1e-3)
            if damping > 1e8:
                break
            continue
        theta, point = trial_theta, trial
        iterations += 1
        if size < STEP_LIMIT and damping < 1e-2:
            converged = True
            break
        damping = 0.0 if damping < 1e-3 else damping / 8.0
        scale = np.minimum(np.maximum(bound, 1e-8 * (1.0 + np.abs(theta))), 1.0 + np.abs(theta))
        parts, scores = _scoring(problem, theta, point, scale)
        information, gradient = _summed(problem, theta, parts, scores)
    covariance = covariance_of(information)
    kept = problem.n_model
    warnings = [] if converged else [f"no convergence: last step {size:.3g} bounds long"]
    return FitResult(
        method="filter error",
        model=model,
        names=problem.names,
        estimate=theta,
        covariance=covariance,
        covariance_white=covariance,
        degrees_of_freedom=np.full(len(theta), float(max(problem.inner.samples - kept, 1))),
        residuals=tuple(point.e),
        fitted=tuple(m.outputs - e for m, e in zip(maneuvers, point.e, strict=True)),
        residual_kind="innovation",
        noise_covariance=np.atleast_2d(np.cov(np.vstack(point.e).T)),
        iterations=iterations,
        converged=converged,
        warnings=tuple(warnings),
        details={
            "cost": point.cost,
            "process_deviation": np.exp(theta[kept : kept + len(process)]),
            "noise_deviation": np.exp(theta[kept + len(process) :]),
            **pulls(parts, scores, covariance),
        },
    )


def information_at(
    model: LinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...], theta: Array
) -> Array:
    """Return the Fisher information of the stochastic model at given values of everything.

    Parameters
    ----------
    model, maneuvers, process
        As for `fit_filter_error`.
    theta : Array
        The vector of a filter-error result: model and constants, log process and noise deviations.

    Raises
    ------
    IdentificationError
        If the filter fails there.
    """
    problem = FilterProblem(model, maneuvers, process)
    point = problem.evaluate(theta)
    if point is None:
        raise IdentificationError(f"model {model.name}: the Kalman filter fails at these values")
    parts, scores = _scoring(problem, theta, point, np.full(len(theta), 1e-2))
    return _summed(problem, theta, parts, scores)[0]


def _first_guess(problem: FilterProblem, first: Array, *, fit_first: bool) -> tuple[Array, Array]:
    """Start from output error; split its residual power between both kinds of noise."""
    inner = problem.inner
    optimum = minimise(inner, first, max_iterations=15 if fit_first else 0)
    residual = np.hstack(optimum.residuals)
    deviation = np.maximum(np.std(residual, axis=1), 1e-12)
    differences = np.std(np.diff(residual, axis=1), axis=1) / np.sqrt(2.0)
    noise = np.clip(differences, 0.05 * deviation, np.sqrt(NOISE_SHARE[1]) * deviation)
    model = problem.model
    process = []
    for state in problem.process:
        size = deviation[model.outputs.index(state)] if state in model.outputs else 0.1
        # Over the one second a disturbance is guessed to last, so the number is per root second.
        process.append(np.log(np.sqrt(NOISE_SHARE[0]) * size))
    theta = np.concatenate([optimum.theta, process, np.log(noise)])
    bound = 1.0 / np.sqrt(np.maximum(np.diag(optimum.information), 1e-300))
    scale = np.concatenate([np.minimum(bound, 1e6), np.full(len(theta) - problem.n_model, 0.1)])
    return theta, scale


def _scoring(
    problem: FilterProblem, theta: Array, point: _Likelihood, scale: Array
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


def _summed(
    problem: FilterProblem, theta: Array, parts: Sequence[Array], scores: Sequence[Array]
) -> tuple[Array, Array]:
    """Return information and minus the cost's gradient of all maneuvers and the prior."""
    information, gradient = np.sum(parts, axis=0), np.sum(scores, axis=0)
    n = problem.n_model
    information[:n, :n] += np.diag(problem.inner.prior_precision)
    gradient[:n] -= problem.inner.prior_precision * (theta[:n] - problem.inner.prior_mean)
    return information, gradient


def _free(inner: OutputProblem, theta: Array, gradient: Array) -> BoolArray:
    own, slope = theta[: len(inner.names)], gradient[: len(inner.names)]
    return ~(((own <= inner.lower) & (slope < 0.0)) | ((own >= inner.upper) & (slope > 0.0)))


def _step(
    information: Array, gradient: Array, damping: float, free: BoolArray
) -> tuple[Array, float, Array]:
    full, bounds = np.zeros(len(gradient)), np.ones(len(gradient))
    information, gradient = information[np.ix_(free, free)], gradient[free]
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information / np.outer(scale, scale)
    value, vector = np.linalg.eigh(scaled)
    value = np.maximum(value, 1e-12 * value[-1])
    bound = np.sqrt(np.einsum("ij,j,ij->i", vector, 1.0 / value, vector))
    move = vector @ ((vector.T @ (gradient / scale)) / (value + damping))
    full[free] = move / scale
    bounds[free] = bound / scale
    return full, float(np.max(np.abs(move) / bound, initial=0.0)), bounds
