"""Outputs and sensitivities of a user's equations over several maneuvers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.expressions.expression_graph import ExpressionError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.equation_recursion import SampledEquations, run_equations
from host.sysid.numerics.fractional_delay import delay_columns, slope_by_delay
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import EquationMotion

MOST_SUBSTEPS = 64
# What halving the step may move an output by, as a share of its spread. Noise is a thousandth at
# least (`CLEAN_SHARE`): over 10 000 samples this is a tenth of a half-width, were it all of one
# sign.
STEP_TOLERANCE = 1e-6


class NonlinearProblem(OutputProblem):
    """The same for equations.

    Attributes
    ----------
    substeps : int
        Runge-Kutta steps from sample to sample; found at the start values, and where a search ends.
    """

    def __init__(self, model: NonlinearModel, maneuvers: Sequence[Maneuver]) -> None:
        super().__init__(model, maneuvers)
        self.nonlinear = model
        self.source = model.source
        self._run = self.source.code.loop(run_equations)
        place = {p.name: k for k, p in enumerate(model.parameters)}
        first_own = self.n_common + self.n_local - len(model.own_parameters)
        place |= {p.name: first_own + k for k, p in enumerate(model.own_parameters)}
        self.first_own = first_own
        self.constants, self.tables = self.source.constant_values, self.source.table_values
        self.column = np.array(
            [*(place.get(name, -1) for name in self.source.parameters), -1], dtype=np.int64
        )
        self.bias_column, self.offset_column = self._sampler.rate, self._sampler.offset
        delay = {y: k for k, d in enumerate(model.delays, len(model.parameters)) for y in d.outputs}
        self.input_column = np.array([delay.get(u, -1) for u in model.inputs], dtype=np.int64)
        self.substeps = 1
        self.ramp = 1.0 if model.hold == "foh" else 0.0
        self._stepped = False

    def _limits(self) -> tuple[Array, Array, Array, Array]:
        lower, upper, mean, precision = super()._limits()
        model = self.model
        assert isinstance(model, NonlinearModel)
        count = len(model.own_parameters)
        for part in self._parts:
            for k, parameter in zip(
                part.index[len(part.index) - count :], model.own_parameters, strict=True
            ):
                lower[k], upper[k], mean[k] = parameter.lower, parameter.upper, parameter.start
                precision[k] = parameter.prior_sd**-2
        return lower, upper, mean, precision

    def first_guess(self) -> Array:
        """Return start values: the model's, and initial states from first samples."""
        model = self.nonlinear
        theta = np.zeros(len(self.names))
        theta[: len(model.parameters)] = model.start
        for part, maneuver in zip(self._parts, self.maneuvers, strict=True):
            inputs = zip(model.inputs, maneuver.inputs[0].tolist(), strict=True)
            measured = dict(inputs) | dict(
                zip(model.outputs, maneuver.outputs[0].tolist(), strict=True)
            )
            known = measured | self.source.first_states(measured)
            for state in model.initial_states:
                k = self._sampler.first[model.states.index(state)]
                theta[part.index[k]] = known.get(state, 0.0)
            own = part.index[self.first_own :]
            theta[own] = [p.start for p in model.own_parameters]
        return theta

    def check_start(self, theta: Array) -> None:
        """Try the equations at the first sample of every maneuver, before code is made of them.

        Raises
        ------
        IdentificationError
            If one has no finite value; the line names it.
        """
        for number, maneuver in enumerate(self.maneuvers):
            g = self.given(number, theta)
            try:
                self.source.check_first_sample(
                    g.start.tolist(),
                    maneuver.inputs[0].tolist(),
                    g.p[: len(self.source.parameters)].tolist(),
                )
            except ExpressionError as error:
                raise IdentificationError(
                    f"{error}, at the start values of model {self.model.name}"
                ) from None

    def motion(self, number: int, theta: Array, slopes: bool) -> EquationMotion:
        """Return what the simulator takes of a maneuver, slopes or not."""
        offset = self.output_offsets(self.local(number, theta))
        return EquationMotion(self._run, self.given(number, theta), offset, self.offset_column)

    def model_at(self, theta: Array) -> LinearModel:
        """Return the model with the tangent at the mean of its simulated states."""
        found = self.simulated(theta)
        if found is None:
            return self.model
        x = np.concatenate([states for _, states in found]).mean(axis=0)
        u = np.concatenate([m.inputs for m in self.maneuvers]).mean(axis=0)
        own = np.mean([theta[part.index[self.first_own :]] for part in self._parts], axis=0)
        return self.nonlinear.tangent_at(x, u, theta, own)

    def given(self, number: int, theta: Array) -> SampledEquations:
        """Return the arguments of the simulation of one maneuver at a parameter vector."""
        part = self._parts[number]
        local = self.local(number, theta)
        held = inputs = np.ascontiguousarray(self.maneuvers[number].inputs)
        slopes, shifts = np.zeros_like(inputs), np.zeros(inputs.shape[1])
        if (self.input_column >= 0).any():
            inputs = inputs.copy()
            for j in np.flatnonzero(self.input_column >= 0):
                shift = local[self.input_column[j]] / part.dt_s
                shifts[j] = shift if self.ramp == 0.0 else 0.0
                at_once = held[:, [j]]
                inputs[:, j] = delay_columns(at_once, shift)[:, 0]
                slopes[:, j] = slope_by_delay(at_once, shift)[:, 0] / part.dt_s
        return SampledEquations(
            start=self._sampler.start(local),
            by_start=self._sampler.by_start,
            inputs=inputs,
            held=held,
            shift=shifts,
            by_delay=slopes,
            input_column=self.input_column,
            p=self.nonlinear.parameter_vector(theta, local[self.first_own : -1]),
            column=self.column,
            c=self.constants,
            t=self.tables,
            bias=local[self.bias_column],
            bias_column=self.bias_column,
            dt_s=part.dt_s,
            substeps=self.substeps,
            ramp=self.ramp,
        )

    def output_offsets(self, local: Array) -> Array:
        """Return the biases of the outputs among the unknowns of a maneuver, (p,)."""
        return np.asarray(local[self.offset_column])

    def choose_step(self, theta: Array) -> None:
        """Halve the step until that moves no output any more; once, where the model is finite."""
        if not self._stepped:
            self.refine_step(theta)

    def refine_step(self, theta: Array) -> bool:
        """Halve the step until that moves no output here; return whether it was too long.

        A model may be stiffer where a search ends than where it began.
        """
        spread = np.std(np.hstack([part.measured for part in self._parts]), axis=1)
        limit = STEP_TOLERANCE * np.maximum(spread, np.sqrt(self.least_variance))
        begun = chosen = self.substeps
        coarse = self.simulated(theta)
        compared = False
        while chosen < MOST_SUBSTEPS:
            self.substeps = 2 * chosen
            fine = self.simulated(theta)
            if fine is not None and coarse is not None:
                compared = True
                moved = [
                    np.max(np.abs(a - b), axis=1)
                    for (a, _), (b, _) in zip(coarse, fine, strict=True)
                ]
                if np.all(np.max(moved, axis=0) <= limit):
                    break
            coarse, chosen = fine, self.substeps
        self._stepped |= compared
        self.substeps = chosen if compared else begun
        return self.substeps != begun
