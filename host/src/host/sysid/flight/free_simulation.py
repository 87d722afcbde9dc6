"""A fitted model run freely over maneuvers: only constants and start states are fitted to each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.estimators.output_error_fit import fit_output_error
from host.sysid.identification_error import IdentificationError
from host.sysid.models.diagnostics import SignalFit, signal_fits
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.input_coherence import InputCoherence, input_coherence
from host.sysid.numerics.output_error_problem import OutputProblem, Response


def free_simulation(frozen: LinearModel, maneuvers: Sequence[Maneuver]) -> list[Array]:
    """Return the outputs of a model without free parameters over maneuvers, (samples, outputs).

    Biases and start states that the model has are fitted to each; NaN where it diverges.
    """
    simulated = []
    for maneuver in maneuvers:
        try:
            problem = OutputProblem(frozen, [maneuver])
            # Nothing but constants is free here, which the door would refuse.
            best = fit_output_error(
                frozen,
                [maneuver],
                coloured_noise=False,
                start=problem.first_guess(),
                multiple_starts=False,
            )
            simulated.append(best.fitted[0])
        except IdentificationError:
            simulated.append(np.full_like(maneuver.outputs, np.nan))
    return simulated


def responses_with_constants(problem: OutputProblem, estimate: Array) -> list[Response] | None:
    """Return outputs and sensitivities at an estimate, constants of each maneuver fitted.

    Outputs are linear in biases and start states: one weighted least-squares step finds them.

    Parameters
    ----------
    problem : OutputProblem
    estimate : Array, shape (P,)
        Its first entries are the common parameters.

    Returns
    -------
    list of Response or None
        None where the model diverges.
    """
    theta, count = problem.first_guess(), problem.n_common
    theta[:count] = estimate[:count]
    responses = problem.respond(theta)
    if responses is None:
        return None
    residuals = [problem.measured(k) - r.y for k, r in enumerate(responses)]
    for number, (response, residual) in enumerate(zip(responses, residuals, strict=True)):
        constants = response.sensitivities[:, :, count:]
        weight = 1.0 / np.maximum(np.mean(residual**2, axis=1), 1e-300)
        step = weighted_fit(residual[:, :, None], constants, weight)[:, 0]
        theta[problem.columns(number)[count:]] += step
    problem.release(responses)
    return problem.respond(theta)


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


def residual_coherence(
    model: LinearModel, estimate: Array, maneuvers: Sequence[Maneuver]
) -> InputCoherence | None:
    """Return whether inputs drive what a free simulation leaves; None where it diverges."""
    problem = OutputProblem(model, maneuvers)
    responses = responses_with_constants(problem, estimate)
    return None if responses is None else input_coherence(problem, responses)


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
    count = len(model.parameters)
    A, B, C, D = model.matrices(result.estimate[:count])
    return replace(
        model, A=A, B=B, C=C, D=D, terms=(), parameters=(), delays=(), accelerometer_offsets=()
    )
