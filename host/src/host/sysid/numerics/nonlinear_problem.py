"""Outputs and sensitivities of a user's equations over several maneuvers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.expressions.expression_graph import ExpressionError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.equation_recursion import simulate_equations, simulate_with_slopes
from host.sysid.numerics.fractional_delay import delay_columns, slope_by_delay
from host.sysid.numerics.output_error_problem import OutputProblem, Response

MOST_SUBSTEPS = 64
# Of an output's spread: what halving the step may move it by. Noise is a thousandth at least
# (`CLEAN_SHARE`): over 10 000 samples this is a tenth of a half-width, were it all of one sign.
STEP_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class Given:
    """What the simulation of one maneuver is given at a parameter vector."""

    local: Array  # unknowns of the maneuver, a zero behind
    start: Array
    inputs: Array  # as late as they are
    held: Array  # not yet late, and by how many samples they are where they are held
    shift: Array
    input_slopes: Array  # by their delay
    parameters: Array
    bias: Array


def output_problem(model: LinearModel, maneuvers: Sequence[Maneuver]) -> OutputProblem:
    """Return the problem of output error of a linear model, or of a user's equations."""
    if isinstance(model, NonlinearModel):
        return NonlinearProblem(model, maneuvers)
    return OutputProblem(model, maneuvers)


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
        code = self.source.code
        self._simulate = code.loop(simulate_equations)
        self._with_slopes = code.loop(simulate_with_slopes)
        place = {p.name: k for k, p in enumerate(model.parameters)}
        first_own = self.n_common + self.n_local - len(model.own_parameters)
        place |= {p.name: first_own + k for k, p in enumerate(model.own_parameters)}
        self.first_own = first_own
        self.constants, self.tables = self.source.constant_values, self.source.table_values
        self.column = np.array(
            [*(place.get(name, -1) for name in self.source.parameters), -1], dtype=np.int64
        )
        self.bias_column = np.full(len(model.states), -1, dtype=np.int64)
        for k, state in enumerate(model.state_biases):
            self.bias_column[model.states.index(state)] = self.n_common + k
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
                k = self._start_parameter[model.states.index(state)]
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
                    g.parameters[: len(self.source.parameters)].tolist(),
                )
            except ExpressionError as error:
                raise IdentificationError(
                    f"{error}, at the start values of model {self.model.name}"
                ) from None

    def respond(self, theta: Array) -> list[Response] | None:
        """Simulate every maneuver with sensitivities; None if a response diverges."""
        self.choose_step(theta)
        result = []
        for number, part in enumerate(self._parts):
            g = self.given(number, theta)
            samples, n = len(g.inputs), len(self.model.states)
            x, y = np.empty((samples, n)), np.empty((samples, len(self.model.outputs)))
            slope = self._memory_for(number, (len(self.model.outputs), samples, self._width))
            if not finite(
                self._with_slopes, g.start, self._start_slopes, g.inputs, g.held, g.shift,
                g.input_slopes, self.input_column, g.parameters, self.column, self.constants,
                self.tables, g.bias, self.bias_column, part.dt_s, self.substeps, self.ramp,
                x, y, slope,
            ):  # fmt: skip
                return None
            out = self._with_biases(y, g.local)
            for j in np.flatnonzero(self._bias_parameter >= 0):
                slope[j, :, self._bias_parameter[j]] += 1.0
            self._delay(out, slope, g.local, part.dt_s)
            if part.missing is not None:
                slope[part.missing] = 0.0  # what was not measured tells nothing
            result.append(Response(out, slope))
        return result

    def outputs(self, theta: Array) -> list[Array] | None:
        """Simulate without sensitivities: outputs (p, samples) per maneuver, None if divergent."""
        self.choose_step(theta)
        found = self.simulated(theta, self.substeps, self.ramp)
        return None if found is None else [y for y, _ in found]

    def simulated(
        self, theta: Array, substeps: int, ramp: float
    ) -> list[tuple[Array, Array]] | None:
        """Return outputs (p, samples) and states (samples, n) of each maneuver.

        Parameters
        ----------
        theta : Array
        substeps : int
            Runge-Kutta steps from sample to sample.
        ramp : float
            1 for first-order hold of the inputs, 0 for zero-order hold.

        Returns
        -------
        list or None
            None if one diverges.
        """
        result: list[tuple[Array, Array]] = []
        for number, part in enumerate(self._parts):
            g = self.given(number, theta)
            x = np.empty((len(g.inputs), len(self.model.states)))
            y = np.empty((len(g.inputs), len(self.model.outputs)))
            if not finite(
                self._simulate, g.start, g.inputs, g.held, g.shift, g.parameters, self.constants,
                self.tables, g.bias, part.dt_s, substeps, ramp, x, y,
            ):  # fmt: skip
                return None
            out = self._with_biases(y, g.local)
            self._delay(out, np.zeros((len(out), 0, 0)), g.local, part.dt_s)
            result.append((out, x))
        return result

    def model_at(self, theta: Array) -> LinearModel:
        """Return the model with the tangent at the mean of its simulated states."""
        found = self.simulated(theta, self.substeps, self.ramp)
        if found is None:
            return self.model
        x = np.concatenate([states for _, states in found]).mean(axis=0)
        u = np.concatenate([m.inputs for m in self.maneuvers]).mean(axis=0)
        own = np.mean([theta[part.index[self.first_own :]] for part in self._parts], axis=0)
        return self.nonlinear.tangent_at(x, u, theta, own)

    def given(self, number: int, theta: Array) -> Given:
        """Return the arguments of the simulation of one maneuver at a parameter vector."""
        part = self._parts[number]
        local = np.append(theta[part.index], 0.0)  # an index of -1 reads the last
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
        return Given(
            local=local,
            start=self._known_start + local[self._start_parameter],
            inputs=inputs,
            held=held,
            shift=shifts,
            input_slopes=slopes,
            parameters=self.nonlinear.parameter_vector(theta, local[self.first_own : -1]),
            bias=local[self.bias_column],
        )

    def output_offsets(self, local: Array) -> Array:
        """Return the biases of the outputs among the unknowns of a maneuver, (p,)."""
        return np.asarray(local[self._bias_parameter])

    def _with_biases(self, y: Array, local: Array) -> Array:
        out = np.ascontiguousarray(y.T)
        out += self.output_offsets(local)[:, None]
        return out

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
        substeps = self.substeps
        coarse = self.simulated(theta, substeps, self.ramp)
        compared = False
        while substeps < MOST_SUBSTEPS:
            fine = self.simulated(theta, 2 * substeps, self.ramp)
            if fine is not None and coarse is not None:
                compared = True
                moved = [
                    np.max(np.abs(a - b), axis=1)
                    for (a, _), (b, _) in zip(coarse, fine, strict=True)
                ]
                if np.all(np.max(moved, axis=0) <= limit):
                    break
            coarse, substeps = fine, 2 * substeps
        if not compared or substeps == self.substeps:
            self._stepped |= compared
            return False
        self._stepped, self.substeps = True, substeps
        return True


def finite(run: Callable[..., bool], *given: object) -> bool:
    """Run a kernel; as Python it raises where the machine's numbers would be infinite or NaN."""
    try:
        return bool(run(*given)) and bool(np.isfinite(given[-1]).all())  # type: ignore[call-overload]
    except (ArithmeticError, ValueError):
        return False
