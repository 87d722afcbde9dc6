"""Innovations of a user's equations: the problem of filter error, and its scoring.

The filter is an extended Kalman filter whose gain follows the motion; nothing is linear about a
mean. Its likelihood is exact for that filter (Jategaonkar, Flight Vehicle System Identification,
2nd ed., ch. 5). Slopes of states and outputs within it are exact, those of its likelihood by the
unknowns are one-sided differences over so little of a bound that no bend of the innovations counts:
over a hundredth, six degrees of freedom in gusts stood still half a bound beside their optimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.numerics.equation_filter import filter_equations
from host.sysid.numerics.nonlinear_problem import Given, NonlinearProblem, finite
from host.sysid.numerics.process_noise import air_states, steady_covariance

STEP_BOUNDS = 1e-4  # of a bound: differences
LOG_STEP = 1e-5  # of a logarithm of a deviation
# A filter corrects what a step misses: at most two from sample to sample, one of a quick record.
MOST_FILTER_STEPS, QUICK_S = 2, 0.0125


@dataclass(slots=True)
class EquationLikelihood:
    """Result of the filter at one set of unknowns, per maneuver (samples, outputs) each.

    Attributes
    ----------
    e : list of Array
        Measured less predicted one sample ahead.
    white, power : list of Array
        Independent innovations and their variances.
    cost : float
        Negative log likelihood and prior, up to a constant.
    """

    e: list[Array]
    white: list[Array]
    power: list[Array]
    cost: float

    @property
    def scaled(self) -> list[Array]:
        """Innovations of unit variance."""
        return [w / np.sqrt(s) for w, s in zip(self.white, self.power, strict=True)]


class EquationFilterProblem:
    """Innovations as a function of the unknowns, log process and log measurement deviations.

    Parameters
    ----------
    model : NonlinearModel
    maneuvers : sequence of Maneuver
    process : tuple of str
        States that white process noise drives.

    Raises
    ------
    IdentificationError
        If a state of `process` is none of the model.
    """

    def __init__(
        self, model: NonlinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...]
    ) -> None:
        strangers = [s for s in process if s not in model.states]
        if strangers:
            raise IdentificationError(
                f"process noise on {', '.join(strangers)}; states are {', '.join(model.states)}"
            )
        self.output_problem = NonlinearProblem(model, maneuvers)
        self.model = model
        self.maneuvers = tuple(maneuvers)
        self.process = process
        self.process_index = [model.states.index(s) for s in process]
        self.n_model = len(self.output_problem.names)
        self.names = (
            *self.output_problem.names,
            *(f"log_process.{s}" for s in process),
            *(f"log_noise.{y}" for y in model.outputs),
        )
        self._run = model.source.code.loop(filter_equations)
        late = {y: k for k, d in enumerate(model.delays, len(model.parameters)) for y in d.outputs}
        self._late = [late.get(y, -1) for y in model.outputs]
        self._leader = np.array([self._late.index(k) for k in self._late], dtype=np.int64)
        self._steps = np.zeros(0)

    def noise(self, theta: Array) -> tuple[Array, Array]:
        """Return spectral density of every state's process noise and variance of every output."""
        split = self.n_model + len(self.process)
        intensity = np.zeros(len(self.model.states))
        with np.errstate(over="ignore"):
            intensity[self.process_index] = np.exp(2.0 * theta[self.n_model : split])
            return intensity, np.exp(2.0 * theta[split:])

    def evaluate(self, theta: Array) -> EquationLikelihood | None:
        """Return innovations and cost; None where the filter or the model fails."""
        found = EquationLikelihood([], [], [], 0.0)
        cost = 0.0
        for number in range(len(self.maneuvers)):
            run = self._filtered(number, theta)
            if run is None:
                return None
            e, white, power = run
            found.e.append(e)
            found.white.append(white)
            found.power.append(power)
            cost += 0.5 * float(np.sum(white**2 / power + np.log(power)))
        deviation = theta[: self.n_model] - self.output_problem.prior_mean
        found.cost = cost + 0.5 * float(np.sum(self.output_problem.prior_precision * deviation**2))
        return found if np.isfinite(found.cost) else None

    def set_steps(self, bounds: Array) -> None:
        """Set the steps of the differences from the bounds of the unknowns of the model."""
        own = np.where(bounds > 0.0, STEP_BOUNDS * bounds, 1e-6)
        self._steps = np.concatenate([own, np.full(len(self.names) - self.n_model, LOG_STEP)])

    def scoring(
        self, theta: Array, point: EquationLikelihood
    ) -> tuple[list[Array], list[Array], list[Array]]:
        """Return Fisher information, negative gradient and slopes of the innovations by maneuver.

        Of an innovation w of variance s, given those before, the information is dw dw / s + ds ds /
        (2 s^2) (Klein & Morelli, Aircraft System Identification, ch. 6).

        Returns
        -------
        list of Array, shape (P, P)
        list of Array, shape (P,)
        list of Array, shape (samples, outputs, P)
            Of the innovations over their deviation.
        """
        size = len(theta)
        parts: list[Array] = []
        scores: list[Array] = []
        slopes: list[Array] = []
        for number, (white, power) in enumerate(zip(point.white, point.power, strict=True)):
            active = self._active(number)
            by_white, by_power = (np.empty((white.size, len(active))) for _ in range(2))
            for k, unknown in enumerate(active):
                dw, ds = self._difference(number, theta, int(unknown), white, power)
                by_white[:, k] = (dw / np.sqrt(power)).ravel()
                by_power[:, k] = (ds / power).ravel()
            unit = (white / np.sqrt(power)).ravel()
            information, gradient = np.zeros((size, size)), np.zeros(size)
            information[np.ix_(active, active)] = (
                by_white.T @ by_white + 0.5 * by_power.T @ by_power
            )
            gradient[active] = -by_white.T @ unit - 0.5 * by_power.T @ (1.0 - unit**2)
            whole = np.zeros((white.size, size))
            whole[:, active] = by_white
            parts.append(information)
            scores.append(gradient)
            slopes.append(whole.reshape(*white.shape, size))
        return parts, scores, slopes

    def _active(self, number: int) -> IntArray:
        noise = np.arange(self.n_model, len(self.names))
        return np.concatenate([self.output_problem.columns(number), noise])

    def _difference(
        self, number: int, theta: Array, unknown: int, white: Array, power: Array
    ) -> tuple[Array, Array]:
        for step in (self._steps[unknown], -self._steps[unknown]):
            moved = theta.copy()
            moved[unknown] += step
            run = self._filtered(number, moved)
            if run is not None:
                return (run[1] - white) / step, (run[2] - power) / step
        raise IdentificationError(f"model {self.model.name}: the filter has no finite slope")

    def _filtered(self, number: int, theta: Array) -> tuple[Array, Array, Array] | None:
        """Run the filter over a maneuver: innovations, independent ones, their variances."""
        problem, model, maneuver = self.output_problem, self.model, self.maneuvers[number]
        problem.choose_step(theta)
        g = problem.given(number, theta)
        n, outputs = len(model.states), len(model.outputs)
        intensity, variance = self.noise(theta)
        if not (np.isfinite(intensity).all() and np.isfinite(variance).all()):
            return None
        inputs = g.inputs.shape[1]
        none = np.full(max(n, outputs, inputs), -1, dtype=np.int64)
        e, white, power = (np.empty(maneuver.outputs.shape) for _ in range(3))
        delay_s = np.array([0.0 if k < 0 else theta[k] for k in self._late])
        no_limit = np.full(n, np.inf)
        if not finite(
            self._run, g.start.copy(), self._first_covariance(g, intensity), -no_limit, no_limit,
            intensity, variance, g.inputs, g.held, g.shift, maneuver.outputs, maneuver.seen,
            g.parameters, np.full(len(g.parameters), -1, dtype=np.int64), problem.constants,
            problem.tables, g.bias, none[:n], problem.output_offsets(g.local), none[:outputs],
            delay_s, none[:outputs], self._leader, none[:inputs], maneuver.dt_s,
            self._substeps(maneuver.dt_s), problem.ramp, e, white, power,
        ):  # fmt: skip
            return None
        return (e, white, power) if np.isfinite(e).all() and np.isfinite(white).all() else None

    def _first_covariance(self, g: Given, intensity: Array) -> Array:
        """Return the covariance of the states at the first sample: of air without a start."""
        source, states = self.model.source, self.model.states
        n, m = len(states), g.inputs.shape[1]
        result, f, A = np.zeros((n, n)), np.zeros(n), np.zeros((n, n))
        air = [k for k in air_states(states) if states[k] not in self.model.initial_states]
        if not air:
            return result
        by_input, by_parameter = np.zeros((n, m)), np.zeros((n, len(g.parameters)))
        values = (g.parameters, source.constant_values, source.table_values)
        try:
            source.code.functions["rate_slopes"](
                g.start, g.inputs[0], *values, f, A, by_input, by_parameter
            )
            own = np.ix_(air, air)
            result[own] = steady_covariance(A[own], intensity[air])
        except (ArithmeticError, ValueError):  # no finite slope: the filter says so itself
            pass
        return result

    def _substeps(self, dt_s: float) -> int:
        most = 1 if dt_s <= QUICK_S else MOST_FILTER_STEPS
        return min(self.output_problem.substeps, most)
