"""One-step likelihood of what a fit did not see: does moving air tell it, or the sensors' noise?

Fitted to the first part of every maneuver, output error and a filter go on through the rest with
all parameters, initial states and noises as they were. The filter tells each sample from those
before it; output error does the same by the memory of its residuals, else any noise with a memory
passed for moving air.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.estimators.gust_model import driven_model
from host.sysid.estimators.innovations import driven_states
from host.sysid.linear.linear_stages import LinearFit
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.residual_delays import advance_outputs
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.ar_noise import (
    HIGHEST_ORDER,
    ArNoise,
    choose_order,
    fit_ar,
    lagged_moments,
)
from host.sysid.numerics.model_problems import innovation_problem, output_problem

FITTED_SHARE = 2.0 / 3.0  # of a maneuver, from its start


def first_part(maneuver: Maneuver) -> Maneuver:
    """Return what of a maneuver is fitted before the rest is predicted."""
    count = round(FITTED_SHARE * maneuver.samples)
    sampled = None if maneuver.sampled is None else maneuver.sampled[:count]
    return replace(
        maneuver,
        inputs=maneuver.inputs[:count],
        outputs=maneuver.outputs[:count],
        sampled=sampled,
    )


def coloured(fitted: FitResult, maneuvers: Sequence[Maneuver]) -> bool:
    """Return whether residuals have a memory: of white ones nothing is left for moving air."""
    seen = [m.seen for m in maneuvers]
    return any(
        _memory([r[s[:, j], j] for r, s in zip(fitted.residuals, seen, strict=True)])[0].order > 0
        for j in range(len(fitted.model.outputs))
    )


def _memory(residuals: Sequence[Array]) -> tuple[ArNoise, float]:
    """Return the noise model of an output, its order by BIC, and the variance of innovations."""
    none = [np.zeros((len(e), 0)) for e in residuals]
    moments, count = lagged_moments(residuals, none, HIGHEST_ORDER), sum(map(len, residuals))
    order = choose_order(moments, count)
    coefficient, squares = fit_ar(moments[: order + 1, : order + 1], order)
    return ArNoise.from_coefficient(coefficient), squares / count


def cost_by_residuals(
    model: LinearModel, fitted: FitResult, maneuvers: Sequence[Maneuver]
) -> float:
    """Return minus the log likelihood of the rest by output error; infinite if it diverges.

    Parameters
    ----------
    model : LinearModel
    fitted : FitResult
        Fit of white output error, to the `first_part` of each maneuver.
    maneuvers : sequence of Maneuver
        Whole.
    """
    problem = output_problem(model, maneuvers)
    responses = problem.respond(fitted.estimate)
    if responses is None:
        return np.inf
    residuals = [problem.residual(k, r.y) for k, r in enumerate(responses)]
    cost = 0.0
    for j, least in enumerate(problem.least_variance):
        whole = [r[j][m.seen[:, j]] for r, m in zip(residuals, maneuvers, strict=True)]
        counts = [int(np.sum(first_part(m).seen[:, j])) for m in maneuvers]
        noise, power = _memory([e[:count] for e, count in zip(whole, counts, strict=True)])
        variance = max(power, float(least))
        rest = [noise.whiten(e[:, None])[count:, 0] for e, count in zip(whole, counts, strict=True)]
        cost += 0.5 * sum(float(np.sum(e**2 / variance + np.log(variance))) for e in rest)
    return cost


def cost_by_innovations(
    model: LinearModel,
    moving: LinearFit,
    maneuvers: Sequence[Maneuver],
    airspeed_mps: float | None,
) -> float:
    """Return minus the log likelihood of the rest by a filter; infinite if it fails there.

    Parameters
    ----------
    model : LinearModel
        With delays, which go out of the rest as they did.
    moving : LinearFit
        Fit of filter error, to the `first_part` of each maneuver.
    maneuvers : sequence of Maneuver
        Whole.
    airspeed_mps : float or None
        Airspeed at trim, for the time scale of gusts.
    """
    delays = {name: value for name, (value, _) in moving.delays.items()}
    whole = [advance_outputs(m, model, delays) if delays else m for m in maneuvers]
    result, process = moving.result, driven_states(moving.result)
    filtered = result.model
    if not has_equations(filtered):
        filtered = driven_model(filtered, process, airspeed_mps or 0.0)
    costs = []
    for data in (whole, [first_part(m) for m in whole]):
        point = innovation_problem(filtered, data, process).evaluate(result.estimate)
        if point is None:
            return np.inf
        costs.append(float(point.cost))
    return costs[0] - costs[1]
