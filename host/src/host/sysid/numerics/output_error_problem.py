"""Outputs and sensitivities of a model over several maneuvers: the problem of output error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.errors import IdentificationError
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.fractional_delay import delay_columns, slope_by_delay
from host.sysid.numerics.sampled_model import SampledModel, Sampler
from host.sysid.numerics.simulator import (
    EquationMotion,
    MatrixMotion,
    Response,
    simulate_with_slopes,
)

# Least noise as a share of an output's motion: no column is better than this, nor the model of it.
# The information of one column without noise would drown that of all others, and 73 to 93 % of the
# intervals would hold.
CLEAN_SHARE = 1e-3


@dataclass(frozen=True, slots=True)
class _Part:
    drive: Array
    measured: Array
    missing: BoolArray | None  # outputs at samples at which they were not measured, (p, samples)
    index: IntArray  # of the columns of this maneuver in the whole vector
    dt_s: float


class OutputProblem:
    """Residuals and sensitivities of all outputs of several maneuvers.

    Parameters
    ----------
    model : LinearModel
        Its parameters, biases, initial states and delays are the unknowns.
    maneuvers : sequence of Maneuver
        The data.

    Attributes
    ----------
    least_variance : Array, shape (p,)
        Below it an estimated noise variance is rounding error, or that of the numbers' step.
    clean_variance : Array, shape (p,)
        The same without the numbers' step: below it is no noise of a sensor.
    known_variance : Array, shape (p,)
        Variance of the noise of outputs for which the model states it; NaN where it is estimated.
    counts : Array, shape (p,)
        Samples at which each output was measured.

    Raises
    ------
    IdentificationError
        If the columns of a maneuver do not fit the model.
    """

    def __init__(self, model: LinearModel, maneuvers: Sequence[Maneuver]) -> None:
        if not maneuvers:
            raise IdentificationError("no maneuver to fit: give at least one")
        self.model = model
        self.maneuvers = tuple(maneuvers)
        self._sampler = Sampler(model)
        common = len(model.parameter_names)
        self.n_common = common
        local = model.local_names(1)
        names = list(model.parameter_names)
        self._parts: list[_Part] = []
        for number, maneuver in enumerate(self.maneuvers, start=1):
            check_shapes(model, maneuver)
            begin = len(names)
            names.extend(model.local_names(number))
            index = np.concatenate([np.arange(common), np.arange(begin, len(names))])
            self._parts.append(
                _Part(
                    drive=self._sampler.drive(maneuver),
                    measured=np.ascontiguousarray(maneuver.outputs.T),
                    missing=None if maneuver.sampled is None else ~maneuver.sampled.T,
                    index=index.astype(np.int64),
                    dt_s=maneuver.dt_s,
                )
            )
        self.names = tuple(names)
        self.n_local = len(local)
        self._free_memory: list[list[Array]] = [[] for _ in self._parts]
        power = np.mean(np.square(self._parts[0].measured), axis=1)
        self.least_variance = 1e-20 * np.maximum(power, 1e-30)  # of an output that fits perfectly
        spread = np.var(np.hstack([part.measured for part in self._parts]), axis=1)
        self.clean_variance = np.maximum(self.least_variance, CLEAN_SHARE**2 * spread)
        self.least_variance = self.clean_variance
        noise = dict(model.known_noise)
        self.known_variance = np.array([noise.get(y, np.nan) ** 2 for y in model.outputs])
        # A uniform step is noise of variance step^2 / 12 (Widrow & Kollar, Quantization Noise).
        steps = [m.resolution for m in self.maneuvers if m.resolution is not None]
        if steps:
            self.least_variance = np.maximum(self.least_variance, np.max(steps, axis=0) ** 2 / 12.0)
        self.counts = np.full(len(model.outputs), float(self.samples))
        for part in self._parts:
            if part.missing is not None:
                self.counts -= np.sum(part.missing, axis=1)
        self.lower, self.upper, self.prior_mean, self.prior_precision = self._limits()

    def _limits(self) -> tuple[Array, Array, Array, Array]:
        free = len(self.names)
        lower, upper = np.full(free, -np.inf), np.full(free, np.inf)
        mean, precision = np.zeros(free), np.zeros(free)
        for k, parameter in enumerate(self.model.parameters):
            lower[k], upper[k], mean[k] = parameter.lower, parameter.upper, parameter.start
            precision[k] = parameter.prior_sd**-2
        for k, delay in enumerate(self.model.delays, start=len(self.model.parameters)):
            lower[k], upper[k] = -delay.limit_s, delay.limit_s
            precision[k] = delay.prior_sd_s**-2
        return lower, upper, mean, precision

    @property
    def samples(self) -> int:
        """Samples of all maneuvers together."""
        return sum(m.samples for m in self.maneuvers)

    def columns(self, maneuver: int) -> IntArray:
        """Return which entries of the whole vector the sensitivities of a maneuver belong to."""
        return self._parts[maneuver].index

    def measured(self, maneuver: int) -> Array:
        """Return the measured outputs of a maneuver, shape (p, samples)."""
        return self._parts[maneuver].measured

    def residual(self, maneuver: int, y: Array) -> Array:
        """Return measured less simulated outputs, (p, samples); zero where nothing was measured."""
        result = self._parts[maneuver].measured - y
        missing = self._parts[maneuver].missing
        if missing is not None:
            result[missing] = 0.0
        return np.asarray(result)

    def residual_deviation(self, residuals: Sequence[Array]) -> Array:
        """Return the deviation of every output's residuals where it was measured, (p,).

        Parameters
        ----------
        residuals : sequence of Array, each (p, samples)
            Residuals of every maneuver, zero where nothing was measured.
        """
        deviation = self._share_scale() * np.std(np.hstack(residuals), axis=1)
        return np.asarray(np.maximum(deviation, 1e-12))

    def residual_covariance(self, residuals: Sequence[Array]) -> Array:
        """Return the covariance of residuals as for `residual_deviation`, (p, p)."""
        scale = self._share_scale()
        covariance = np.atleast_2d(np.cov(np.hstack(residuals)))
        return np.asarray(covariance * np.outer(scale, scale), dtype=np.float64)

    def _share_scale(self) -> Array:
        """Return what makes a deviation over all samples that over the measured ones, (p,)."""
        return np.asarray(np.sqrt(self.samples / self.counts))

    def seen(self, maneuver: int, output: int) -> BoolArray | None:
        """Return at which samples of a maneuver an output was measured; None: at all."""
        missing = self._parts[maneuver].missing
        return None if missing is None else ~missing[output]

    def first_guess(self) -> Array:
        """Return start values: the model's, and first measured samples as initial states."""
        theta = np.zeros(len(self.names))
        theta[: len(self.model.parameters)] = self.model.start
        for part, maneuver in zip(self._parts, self.maneuvers, strict=True):
            place = part.index[-len(self.model.initial_states) :]
            for k, state in enumerate(self.model.initial_states):
                if state in self.model.outputs:
                    theta[place[k]] = maneuver.outputs[0, self.model.outputs.index(state)]
        return theta

    def model_at(self, theta: Array) -> LinearModel:
        """Return the model that matrices are taken from at an estimate."""
        return self.model

    def drive(self, maneuver: int) -> Array:
        """Return what drives the model over a maneuver, (samples, w)."""
        return self._parts[maneuver].drive

    def local(self, maneuver: int, theta: Array) -> Array:
        """Return the unknowns of a maneuver, and a zero behind them."""
        return np.append(theta[self._parts[maneuver].index], 0.0)

    def sampled(self, maneuver: int, theta: Array, *, slopes: bool = True) -> SampledModel:
        """Return the model over one sample of a maneuver, its slopes by `columns`."""
        dt_s = self._parts[maneuver].dt_s
        return self._sampler.at(self.local(maneuver, theta), dt_s, slopes=slopes)

    def respond(self, theta: Array) -> list[Response] | None:
        """Simulate every maneuver with sensitivities; None if a response diverges."""
        self.choose_step(theta)
        result = []
        for number, part in enumerate(self._parts):
            shape = (*part.measured.shape, self._sampler.width)
            slope = self._memory_for(number, shape)
            found = self._delayed(number, theta, slope)
            if found is None:
                return None
            if part.missing is not None:
                slope[part.missing] = 0.0  # what was not measured tells nothing
            result.append(Response(found[0], slope))
        return result

    def outputs(self, theta: Array) -> list[Array] | None:
        """Simulate without sensitivities: outputs (p, samples) per maneuver, None if divergent."""
        self.choose_step(theta)
        found = self.simulated(theta)
        return None if found is None else [y for y, _ in found]

    def simulated(self, theta: Array) -> list[tuple[Array, Array]] | None:
        """Return outputs (p, samples) and states (samples, n) of each maneuver; None if divergent.

        Steps between samples are as long as they were chosen.
        """
        result: list[tuple[Array, Array]] = []
        for number in range(len(self._parts)):
            found = self._delayed(number, theta, None)
            if found is None:
                return None
            result.append(found)
        return result

    def _delayed(
        self, number: int, theta: Array, slope: Array | None
    ) -> tuple[Array, Array] | None:
        """Return outputs, as late as they are, and states of a maneuver; None if it diverges.

        Sensitivities of the outputs overwrite `slope` (p, samples, L).
        """
        found = simulate_with_slopes(self.motion(number, theta, slope is not None), slope)
        if found is not None:
            self._delay(found[0], slope, self.local(number, theta), self._parts[number].dt_s)
        return found

    def motion(self, number: int, theta: Array, slopes: bool) -> MatrixMotion | EquationMotion:
        """Return what the simulator takes of a maneuver; its outputs are not late yet."""
        return MatrixMotion(self.sampled(number, theta, slopes=slopes), self.drive(number))

    def check_start(self, theta: Array) -> None:
        """Refuse a start where equations have no value; a linear model has one everywhere."""

    def choose_step(self, theta: Array) -> None:
        """Choose how long steps between samples are; a linear model takes none."""

    def refine_step(self, theta: Array) -> bool:
        """Return whether steps between samples were too long here; a linear model takes none."""
        return False

    def release(self, responses: Sequence[Response]) -> None:
        """Take back the sensitivities of responses that are no longer needed.

        New memory costs as much time as the sensitivities: 375 pages for 24 x 2000 x 4.
        """
        for spare, response in zip(self._free_memory, responses, strict=True):
            spare.append(response.sensitivities)

    def _memory_for(self, number: int, shape: tuple[int, int, int]) -> Array:
        spare = self._free_memory[number]
        return spare.pop() if spare else np.empty(shape)

    def _delay(self, y: Array, slope: Array | None, local: Array, dt_s: float) -> None:
        for k, delay in enumerate(self.model.delays, start=len(self.model.parameters)):
            shift = local[k] / dt_s
            for output in delay.outputs:
                if output not in self.model.outputs:
                    continue  # an input, delayed before it drives
                j = self.model.outputs.index(output)
                at_once = y[j][:, None].copy()
                y[j] = delay_columns(at_once, shift)[:, 0]
                if slope is None:
                    continue
                if shift != 0.0:
                    slope[j] = delay_columns(slope[j], shift)
                slope[j][:, k] += slope_by_delay(at_once, shift)[:, 0] / dt_s


def check_shapes(model: LinearModel, maneuver: Maneuver) -> None:
    """Refuse a maneuver whose columns do not fit the model."""
    for label, array, expected in (
        ("inputs", maneuver.inputs, model.inputs),
        ("outputs", maneuver.outputs, model.outputs),
        ("rates", maneuver.rates, model.states),
    ):
        if array is not None and array.shape[1] != len(expected):
            raise IdentificationError(
                f"{maneuver.name}: {array.shape[1]} {label}, model {model.name} has"
                f" {len(expected)} ({', '.join(expected)})"
            )
