"""A model run freely over maneuvers: constants and start states fitted to each, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.multistart import multistart
from host.sysid.maneuvers.maneuver_detection import LEAD_S
from host.sysid.models.diagnostics import SignalFit, signal_fits
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.model_problems import output_problem
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import Response

CONSTANT_ROUNDS = 6  # steps to the constants of each record, where outputs bend in them
# With the weights of the first guess alone offsets of 20 m/s2 explain az, and its residual is
# coherent with the inputs in calm air (5 times the noise).
WEIGHINGS = 3


@dataclass(frozen=True, slots=True)
class Biases:
    """Biases of the state equations, (n,), and of the outputs, (p,), in one maneuver; of equations
    also the parameters that each record has of its own.
    """

    rate: Array
    output: Array
    own: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True)
class FreeRun:
    """Outputs (samples, p) and states (samples, n) of a model over one maneuver, and the biases it
    was run with; NaN where it diverges.
    """

    outputs: Array
    states: Array
    biases: Biases


@dataclass(frozen=True, slots=True)
class FreeResponses:
    """A free simulation at an estimate with its sensitivities, a response of each maneuver.

    `theta` is the whole vector of the problem, constants fitted.
    """

    problem: OutputProblem
    theta: Array
    responses: Sequence[Response]


def free_runs(
    frozen: LinearModel, maneuvers: Sequence[Maneuver], *, constants: bool = True
) -> list[FreeRun]:
    """Run a model without free parameters over maneuvers.

    Parameters
    ----------
    frozen : LinearModel
        From `frozen_model`.
    maneuvers : sequence of Maneuver
    constants : bool
        Fit the biases and start states that the model has to each maneuver. Otherwise they are
        those of equilibrium in the first 0.3 s, at rest before the input: nothing is fitted.
    """
    return [
        (_fitted_run if constants else _trimmed_run)(frozen, maneuver) for maneuver in maneuvers
    ]


def free_simulation(frozen: LinearModel, maneuvers: Sequence[Maneuver]) -> list[Array]:
    """Return the outputs of a model without free parameters over maneuvers, (samples, outputs).

    Biases and start states that the model has are fitted to each; NaN where it diverges.
    """
    return [run.outputs for run in free_runs(frozen, maneuvers)]


def estimate_with_constants(problem: OutputProblem, estimate: Array) -> Array | None:
    """Return an estimate with the constants of each maneuver fitted, (P,).

    Outputs are linear in biases and start states: weighted least squares finds them, each output
    weighed by what is left of it. Equations of a user take several steps.

    Parameters
    ----------
    problem : OutputProblem
    estimate : Array
        Its first entries are the common parameters.

    Returns
    -------
    Array or None
        None where the model diverges.
    """
    theta, count = problem.first_guess(), problem.n_common
    theta[:count] = estimate[:count]
    for _ in range(CONSTANT_ROUNDS if has_equations(problem.model) else 1):
        responses = problem.respond(theta)
        if responses is None:
            return None
        residuals = [problem.residual(k, r.y) for k, r in enumerate(responses)]
        for number, (response, residual) in enumerate(zip(responses, residuals, strict=True)):
            constants, left = response.sensitivities[:, :, count:], residual
            step: Array = np.zeros(constants.shape[2])
            for _ in range(WEIGHINGS):
                weight = 1.0 / np.maximum(np.mean(left**2, axis=1), 1e-300)
                step = weighted_fit(residual[:, :, None], constants, weight)[:, 0]
                left = residual - constants @ step
            theta[problem.columns(number)[count:]] += step
        problem.release(responses)
    return theta


def weighted_fit(errors: Array, columns: Array, weight: Array) -> Array:
    """Return least-squares coefficients of columns in errors, (k, draws).

    Parameters
    ----------
    errors : Array, shape (p, n, draws)
    columns : Array, shape (p, n, k)
    weight : Array, shape (p,)
    """
    information = np.einsum("j,jna,jnb->ab", weight, columns, columns, optimize=True)
    right = np.einsum("j,jna,jnd->ad", weight, columns, errors, optimize=True)
    return np.asarray(covariance_from_information(information) @ right)


def free_responses(
    model: LinearModel, estimate: Array, maneuvers: Sequence[Maneuver]
) -> FreeResponses | None:
    """Simulate freely at an estimate, constants fitted; None where the model diverges.

    Parameters
    ----------
    model : LinearModel
    estimate : Array
        Its first entries are the common parameters.
    maneuvers : sequence of Maneuver
    """
    problem = output_problem(model, maneuvers)
    theta = estimate_with_constants(problem, estimate)
    responses = None if theta is None else problem.respond(theta)
    if theta is None or responses is None:
        return None
    return FreeResponses(problem, theta, responses)


def fits_of(
    model: LinearModel, maneuvers: Sequence[Maneuver], simulated: Sequence[Array]
) -> tuple[SignalFit, ...]:
    """Return figures of fit of simulated against measured outputs; none of no maneuver."""
    if not maneuvers:
        return ()
    residuals = [m.outputs - y for m, y in zip(maneuvers, simulated, strict=True)]
    return signal_fits(model.outputs, [m.outputs for m in maneuvers], residuals)


def frozen_model(model: LinearModel, result: FitResult) -> LinearModel:
    """Return the model frozen at the estimate, biases and start states left free."""
    return frozen_at(model, result.estimate[: len(model.parameters)])


def frozen_at(model: LinearModel, theta: Array) -> LinearModel:
    """Return the model frozen at values of its parameters, biases and start states left free."""
    if has_equations(model):
        return model.frozen_at(theta)
    A, B, C, D = model.matrices(theta)
    value = dict(zip((p.name for p in model.parameters), theta.tolist(), strict=True))
    return replace(
        model,
        A=A,
        B=B,
        C=C,
        D=D,
        terms=(),
        parameters=(),
        delays=(),
        accelerometer_offsets=(),
        known_starts=(*model.known_starts, *((s, value[p]) for s, p in model.shared_starts)),
        shared_starts=(),
    )


def _fitted_run(frozen: LinearModel, maneuver: Maneuver) -> FreeRun:
    try:
        problem = output_problem(frozen, [maneuver])
        start = problem.first_guess()
        problem.check_start(start)
        best = multistart(problem, start, multiple_starts=False)
    except IdentificationError:
        return _diverged(frozen, maneuver)
    outputs = best.responses[0].y.T.copy()
    return FreeRun(outputs, _states(frozen, maneuver, best.theta), _biases(frozen, best.theta))


def _trimmed_run(frozen: LinearModel, maneuver: Maneuver) -> FreeRun:
    """Run from equilibrium at the mean of the first moment, at rest before the input.

    Equations of a user start from their first guess at that mean.
    """
    lead = slice(0, max(1, round(LEAD_S / maneuver.dt_s)))
    y, u = maneuver.outputs[lead].mean(axis=0), maneuver.inputs[lead].mean(axis=0)
    if has_equations(frozen):
        controls, outputs = (np.tile(mean, (maneuver.samples, 1)) for mean in (u, y))
        at_rest = Maneuver(maneuver.dt_s, controls, outputs, name=maneuver.name)
        return _run_of(frozen, maneuver, output_problem(frozen, [at_rest]).first_guess())
    known = dict(frozen.known_starts)
    x = np.array(
        [
            y[frozen.outputs.index(s)]
            if s in frozen.outputs and s in frozen.initial_states
            else known.get(s, 0.0)
            for s in frozen.states
        ]
    )
    rate, output = -(frozen.A @ x + frozen.B @ u), y - (frozen.C @ x + frozen.D @ u)
    theta = np.array(
        [
            *(rate[frozen.states.index(s)] for s in frozen.state_biases),
            *(output[frozen.outputs.index(name)] for name in frozen.output_biases),
            *(x[frozen.states.index(s)] for s in frozen.initial_states),
        ]
    )
    return _run_of(frozen, maneuver, theta)


def _run_of(frozen: LinearModel, maneuver: Maneuver, theta: Array) -> FreeRun:
    """Run with constants `theta`."""
    simulated = output_problem(frozen, [maneuver]).outputs(theta)
    if simulated is None:
        return _diverged(frozen, maneuver)
    return FreeRun(simulated[0].T.copy(), _states(frozen, maneuver, theta), _biases(frozen, theta))


def _states(frozen: LinearModel, maneuver: Maneuver, theta: Array) -> Array:
    """Return the states of the run with constants `theta`, (samples, n)."""
    problem = output_problem(frozen, [maneuver])
    problem.choose_step(theta)
    run = problem.simulated(theta)
    return np.full((maneuver.samples, len(frozen.states)), np.nan) if run is None else run[0][1]


def _biases(frozen: LinearModel, theta: Array) -> Biases:
    """Return the biases of constants in the order of `LinearModel.local_names`."""
    rate, output = np.zeros(len(frozen.states)), np.zeros(len(frozen.outputs))
    count, theta = len(frozen.state_biases), theta[len(frozen.delays) :]
    for state, value in zip(frozen.state_biases, theta, strict=False):
        rate[frozen.states.index(state)] = value
    for name, value in zip(frozen.output_biases, theta[count:], strict=False):
        output[frozen.outputs.index(name)] = value
    if has_equations(frozen):
        return Biases(rate, output, theta[len(theta) - len(frozen.own_parameters) :])
    return Biases(rate, output)


def _diverged(frozen: LinearModel, maneuver: Maneuver) -> FreeRun:
    n, p = len(frozen.states), len(frozen.outputs)
    outputs, states = (np.full((maneuver.samples, k), np.nan) for k in (p, n))
    return FreeRun(outputs, states, Biases(np.full(n, np.nan), np.full(p, np.nan)))
