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
from host.sysid.numerics.output_error_problem import OutputProblem


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
