"""Innovations of a user's equations: the problem of filter error, and its scoring.

The filter is an extended Kalman filter whose gain follows the motion; nothing is linear about a
mean. Its likelihood is exact for that filter (Jategaonkar, Flight Vehicle System Identification,
2nd ed., ch. 5). Slopes of states and outputs within it are exact, those of its likelihood by the
unknowns are one-sided differences over so little of a bound that no bend of the innovations counts:
over a hundredth, six degrees of freedom in gusts stop half a bound from their optimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.numerics.equation_filter import EquationModel, filter_equations
from host.sysid.numerics.equation_recursion import SampledEquations
from host.sysid.numerics.innovation_problem import (
    Filtered,
    InnovationLikelihood,
    InnovationProblem,
    InnovationSlopes,
)
from host.sysid.numerics.intermittent_filter import SequentialInnovations
from host.sysid.numerics.kalman_filter import filter_without_slopes
from host.sysid.numerics.nonlinear_problem import NonlinearProblem
from host.sysid.numerics.process_noise import air_states, steady_covariance

STEP_BOUNDS = 1e-4  # of a bound: differences
LOG_STEP = 1e-5  # of a logarithm of a deviation
# A filter corrects what a step misses: at most two from sample to sample, one of a quick record.
MOST_FILTER_STEPS, QUICK_S = 2, 0.0125


class EquationFilterProblem(InnovationProblem):
    """The same of equations.

    Parameters
    ----------
    model : NonlinearModel
    maneuvers : sequence of Maneuver
    process : tuple of str
        States that white process noise drives.
    """

    def __init__(
        self, model: NonlinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...]
    ) -> None:
        self._outputs = NonlinearProblem(model, maneuvers)
        super().__init__(self._outputs, process)
        self._source = model.source
        self._run = model.source.code.loop(filter_equations)
        late = {y: k for k, d in enumerate(model.delays, len(model.parameters)) for y in d.outputs}
        self._late = [late.get(y, -1) for y in model.outputs]
        self._leader = np.array([self._late.index(k) for k in self._late], dtype=np.int64)
        self.set_steps(np.zeros(self.n_model))

    def evaluate(self, theta: Array) -> InnovationLikelihood | None:
        """Return innovations and cost; None where the filter or the model fails."""
        runs: list[Filtered] = []
        for number in range(len(self.maneuvers)):
            run = self._filtered(number, theta)
            if run is None:
                return None
            runs.append(run)
        return self.likelihood(theta, runs)

    def set_steps(self, bounds: Array) -> None:
        """Set the steps of the differences from the bounds of the unknowns of the model."""
        own = np.where(bounds > 0.0, STEP_BOUNDS * bounds, 1e-6)
        self._steps = np.concatenate([own, np.full(len(self.names) - self.n_model, LOG_STEP)])

    def slopes(self, theta: Array, point: InnovationLikelihood) -> list[InnovationSlopes]:
        """Return slopes of every maneuver's innovations."""
        return [
            self._differences(number, theta, run).slopes(self.columns(number))
            for number, run in enumerate(point.runs)
            if isinstance(run, SequentialInnovations)
        ]

    def _differences(
        self, number: int, theta: Array, run: SequentialInnovations
    ) -> SequentialInnovations:
        """Return a run of the filter with slopes."""
        active = self.columns(number)
        by_white, by_power = (np.empty((*run.e.shape, len(active))) for _ in range(2))
        for k, unknown in enumerate(active):
            for step in (self._steps[unknown], -self._steps[unknown]):
                moved = theta.copy()
                moved[unknown] += step
                there = self._filtered(number, moved)
                if there is not None:
                    break
            else:
                raise IdentificationError(
                    f"model {self.model.name}: the filter has no finite slope"
                )
            by_white[..., k] = run.whitened((there.independent - run.independent) / step)
            by_power[..., k] = (there.variance - run.variance) / step / run.variance
        return replace(run, by_independent=by_white, by_variance=by_power)

    def _filtered(self, number: int, theta: Array) -> SequentialInnovations | None:
        """Run the filter over a maneuver; None if it fails."""
        problem, model, maneuver = self._outputs, self.model, self.maneuvers[number]
        problem.choose_step(theta)
        g = problem.given(number, theta)
        n, outputs = len(model.states), len(model.outputs)
        intensity, variance = self.noise(theta)
        if not (np.isfinite(intensity).all() and np.isfinite(variance).all()):
            return None
        none = np.full(max(n, outputs, len(g.shift), len(g.p)), -1, dtype=np.int64)
        delay_s = np.array([0.0 if k < 0 else theta[k] for k in self._late])
        equations = EquationModel(
            intensity=intensity,
            inputs=g.inputs,
            held=g.held,
            late=g.shift,
            p=g.p,
            column=none[: len(g.p)],
            c=g.c,
            t=g.t,
            bias=g.bias,
            bias_column=none[:n],
            offset=problem.output_offsets(problem.local(number, theta)),
            offset_column=none[:outputs],
            delay_s=delay_s,
            delay_column=none[:outputs],
            leader=self._leader,
            input_column=none[: len(g.shift)],
            dt_s=maneuver.dt_s,
            substeps=self._substeps(maneuver.dt_s),
            ramp=problem.ramp,
        )
        x, P = g.start.copy(), self._first_covariance(g, intensity)
        run = filter_without_slopes(
            self._run, equations, x, P, variance, maneuver.outputs, maneuver.seen
        )
        if run is None:
            return None
        e, independent, deviation = run
        no_slopes = np.zeros((*e.shape, 0))
        return SequentialInnovations(e, independent, deviation**2, no_slopes, no_slopes)

    def _first_covariance(self, g: SampledEquations, intensity: Array) -> Array:
        """Return the covariance of the states at the first sample: of air without a start."""
        source, states = self._source, self.model.states
        n, m = len(states), g.inputs.shape[1]
        result, f, A = np.zeros((n, n)), np.zeros(n), np.zeros((n, n))
        air = [k for k in air_states(states) if states[k] not in self.model.initial_states]
        if not air:
            return result
        by_input, by_parameter = np.zeros((n, m)), np.zeros((n, len(g.p)))
        values = (g.p, source.constant_values, source.table_values)
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
        return min(self._outputs.substeps, most)
