"""Likelihood of a steady-state Kalman filter's innovations: the problem of filter error.

The unknowns are the parameters of the model, biases, initial states, the process noise of chosen
states and the measurement noise of every output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.intermittent_filter import (
    FilterEquations,
    IntermittentInnovations,
    filter_intermittent,
)
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.process_noise import discrete_noise
from host.sysid.numerics.riccati import filter_innovations, predicted_covariance
from host.sysid.numerics.sampled_model import SampledModel

SAME_PERIOD = 1e-9


@dataclass(frozen=True, slots=True)
class SteadyStateFilter:
    """Steady-state Kalman filter of one sample period.

    Attributes
    ----------
    F : Array, shape (n, n)
        State transition over a sample.
    Q : Array, shape (n, n)
        Covariance of the process noise of a sample.
    P : Array, shape (n, n)
        Covariance of the predicted state.
    S : Array, shape (p, p)
        Covariance of the innovations.
    whitener : Array, shape (p, p)
        Inverse Cholesky factor of S: it makes innovations white, of unit variance.
    K : Array, shape (n, p)
        Gain of the measurement update.
    """

    F: Array
    Q: Array
    P: Array
    S: Array
    whitener: Array
    K: Array


@dataclass(slots=True)
class InnovationLikelihood:
    """Result of the filter at one set of parameters.

    Attributes
    ----------
    z : list of Array
        Per maneuver what `filter_innovations` returns; empty where outputs are missing.
    e : list of Array, shape (samples, p)
        Innovations per maneuver, zero where nothing was measured.
    filters : list of SteadyStateFilter
        Of each maneuver, all outputs measured; the same for all of one sample period.
    intermittent : list of IntermittentInnovations or None
        Of each maneuver some of whose outputs were not measured at every sample.
    cost : float
        Negative log likelihood and prior, up to a constant.
    """

    z: list[Array]
    e: list[Array]
    filters: list[SteadyStateFilter]
    intermittent: list[IntermittentInnovations | None]
    cost: float

    def as_filtered(self, number: int) -> Array:
        """Return innovations of a maneuver as its filter makes them, (samples, p).

        The steady filter takes all outputs of a sample at once, and they are correlated by S; the
        intermittent one takes them in turn.
        """
        missing = self.intermittent[number]
        return self.e[number] if missing is None else missing.independent

    def whitened(self, number: int, innovations: Array) -> Array:
        """Return innovations of a maneuver, those of `as_filtered`, with unit variance."""
        missing = self.intermittent[number]
        if missing is None:
            return np.asarray(innovations @ self.filters[number].whitener.T)
        return np.asarray(innovations / np.sqrt(missing.variance))


class FilterProblem:
    """Innovations as a function of parameters, log process and log measurement deviations.

    Parameters
    ----------
    model : LinearModel
        Without delays.
    maneuvers : sequence of Maneuver
    process : tuple of str
        States that white process noise drives.

    Raises
    ------
    IdentificationError
        If the model has delays or a state of `process` is not its own.
    """

    def __init__(
        self, model: LinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...]
    ) -> None:
        if model.delays:
            raise IdentificationError(
                "filter error has no delays: estimate them by output error and shift the data"
            )
        unknown_states = [s for s in process if s not in model.states]
        if unknown_states:
            raise IdentificationError(
                f"process noise on {', '.join(unknown_states)};"
                f" states are {', '.join(model.states)}"
            )
        self.output_problem = OutputProblem(model, maneuvers)
        self.model = model
        self.maneuvers = tuple(maneuvers)
        self.periods_s = _periods_s([m.dt_s for m in maneuvers])
        self.process = process
        self.process_index = [model.states.index(s) for s in process]
        self.n_model = len(self.output_problem.names)
        self.names = (
            *self.output_problem.names,
            *(f"log_process.{s}" for s in process),
            *(f"log_noise.{y}" for y in model.outputs),
        )

    def noise(self, theta: Array) -> tuple[Array, Array]:
        """Return spectral density of every state's process noise and variance of every output."""
        split = self.n_model + len(self.process)
        intensity = np.zeros(len(self.model.states))
        with np.errstate(over="ignore"):
            intensity[self.process_index] = np.exp(2.0 * theta[self.n_model : split])
            return intensity, np.exp(2.0 * theta[split:])

    def columns(self, maneuver: int) -> IntArray:
        """Return which unknowns the innovations of a maneuver depend on."""
        noise = np.arange(self.n_model, len(self.names))
        return np.concatenate([self.output_problem.columns(maneuver), noise])

    def sampled(self, maneuver: int, theta: Array) -> SampledModel:
        """Return the model over one sample of a maneuver, its slopes by `columns`."""
        found = self.output_problem.sampled(maneuver, theta)
        return found.padded(len(self.names) - self.n_model)

    def evaluate(self, theta: Array) -> InnovationLikelihood | None:
        """Return innovations and cost; None where the filter or the model fails.

        The cost is J = 1/2 sum nu' S^-1 nu + N/2 ln det S over the innovations nu of N samples
        (EQUATIONS.md, eq. 31), plus the prior.
        """
        A, _, C, _ = self.model.matrices(theta)
        intensity, power = self.noise(theta)
        if not (np.isfinite(intensity).all() and np.isfinite(power).all()):
            return None
        of_period: dict[float, SteadyStateFilter] = {}
        likelihood = InnovationLikelihood(z=[], e=[], filters=[], intermittent=[], cost=0.0)
        for number, (maneuver, period_s) in enumerate(
            zip(self.maneuvers, self.periods_s, strict=True)
        ):
            steady = of_period.get(period_s) or steady_state_filter(
                A, C, intensity, np.diag(power), period_s
            )
            if steady is None:
                return None
            of_period[period_s] = steady
            likelihood.filters.append(steady)
            sampled = self.output_problem.sampled(number, theta, slopes=False)
            run = self._intermittent if maneuver.held else self._steady
            if not run(likelihood, sampled, power):
                return None
        prior = self.output_problem.prior_precision
        deviation = theta[: self.n_model] - self.output_problem.prior_mean
        likelihood.cost += 0.5 * float(np.sum(prior * deviation**2))
        return likelihood if np.isfinite(likelihood.cost) else None

    def _steady(self, likelihood: InnovationLikelihood, model: SampledModel, power: Array) -> bool:
        """Add the next maneuver by the steady gain of its filter; return whether it is finite."""
        number, gain = len(likelihood.e), likelihood.filters[-1]
        measured, drive = self.maneuvers[number].outputs, self.output_problem.drive(number)
        finite, z = filter_innovations(model, gain.K, drive, measured)
        if not finite:
            return False
        likelihood.z.append(z)
        likelihood.e.append(z[:, -len(power) :])
        likelihood.intermittent.append(None)
        white = likelihood.e[-1] @ gain.whitener.T
        likelihood.cost += 0.5 * float(np.sum(white**2))
        likelihood.cost -= len(z) * float(np.sum(np.log(np.diag(gain.whitener))))
        return True

    def _intermittent(
        self, likelihood: InnovationLikelihood, model: SampledModel, power: Array
    ) -> bool:
        """Add the next maneuver, outputs missing; return whether the filter did not fail.

        It begins as if all outputs had been measured before the first sample.
        """
        number, steady = len(likelihood.e), likelihood.filters[-1]
        found = filter_intermittent(
            FilterEquations.of_known_noise(model, steady.Q, power, steady.P),
            self.output_problem.drive(number),
            self.maneuvers[number],
        )
        if found is None:
            return False
        likelihood.z.append(np.zeros((0, 0)))
        likelihood.e.append(found.e)
        likelihood.intermittent.append(found)
        likelihood.cost += found.cost
        return True


def _periods_s(steps_s: Sequence[float]) -> list[float]:
    """Return the sample period of each maneuver: rounding of the clock gives one several values."""
    found: list[float] = []
    for step_s in steps_s:
        near = [t for t in found if abs(t - step_s) < SAME_PERIOD * t]
        found.append(near[0] if near else step_s)
    return found


def steady_state_filter(
    A: Array, C: Array, intensity: Array, R: Array, dt_s: float
) -> SteadyStateFilter | None:
    """Return the filter with P of the Riccati equation, S = C P C' + R and K = P C' S^-1.

    EQUATIONS.md, eq. 29. None where none exists.

    Parameters
    ----------
    A : Array, shape (n, n)
    C : Array, shape (p, n)
    intensity : Array, shape (n,)
        Spectral density of each state's noise, unit of the state squared per second.
    R : Array, shape (p, p)
        Covariance of the measurement noise.
    dt_s : float
        Sample period, s.
    """
    F, Qd = discrete_noise(A, intensity, dt_s)
    if not np.isfinite(Qd).all() or np.max(np.abs(F)) > 1e6:
        return None
    try:
        solved, P = predicted_covariance(F, C, Qd, R)
        S = C @ P @ C.T + R
        factor = np.linalg.cholesky(S)
        if not solved:
            return None
        K = np.ascontiguousarray(np.linalg.solve(S, C @ P).T)
        return SteadyStateFilter(F, Qd, P, S, np.linalg.inv(factor), K)
    except np.linalg.LinAlgError:
        return None
