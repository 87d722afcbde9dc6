"""Compare process noise (filter error) with coloured measurement noise (output error) by BIC.

Filter error takes coloured sensor noise for process noise; the filter then follows a motion that
did not happen. Both models have an exact likelihood on the same outputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.output_error_fit import fit_output_error
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver, measurements

DECISIVE = 10.0  # Kass & Raftery, JASA 90 (1995): "very strong" on the scale of 2 log odds


def compare_noise_models(
    result: FitResult, maneuvers: Sequence[Maneuver], start: Array
) -> FitResult:
    """Compare a filter-error result with output error whose noise is autoregressive.

    The Bayesian information criterion is -2 ln L + k ln N with k unknowns and N samples (Schwarz,
    Annals of Statistics 6, 1978; Ljung, System Identification, 2nd ed., ch. 16).

    Parameters
    ----------
    result : FitResult
        Fit of filter error, its cost in `details`.
    maneuvers : sequence of Maneuver
        What it was fitted to.
    start : Array
        Start of output error: the vector of the model without noise parameters.

    Returns
    -------
    FitResult
        With ``bic_over_coloured_noise`` in `details`, positive where coloured measurement noise
        explains the data better. Where it does so decisively there is a warning, and the covariance
        of the model's parameters is that of output error plus the squared difference of both.
    """
    try:
        alternative = fit_output_error(result.model, maneuvers, start=start)
    except IdentificationError:
        return result
    orders = np.asarray(alternative.details["noise_orders"])
    excess = bayes_criterion(result, maneuvers) - bayes_criterion(alternative, maneuvers)
    details = {**result.details, "bic_over_coloured_noise": excess}
    if not alternative.converged or excess < DECISIVE or not np.any(orders):
        return replace(result, details=details)
    count = len(alternative.estimate)
    distance = result.estimate[:count] - alternative.estimate
    covariance = result.covariance.copy()
    covariance[:count, count:] = covariance[count:, :count] = 0.0
    covariance[:count, :count] = alternative.covariance + np.outer(distance, distance)
    freedom = result.degrees_of_freedom.copy()
    freedom[:count] = np.minimum(freedom[:count], alternative.degrees_of_freedom)
    warning = (
        "noise of the sensors with a memory explains the data better than moving air (BIC"
        f" {excess:.0f} lower): use output-error; intervals widened to hold its answer"
    )
    return replace(
        result,
        covariance=covariance,
        degrees_of_freedom=freedom,
        warnings=(*result.warnings, warning),
        details=details,
    )


def bayes_criterion(result: FitResult, maneuvers: Sequence[Maneuver]) -> float:
    """Return the Bayesian information criterion of a fit, up to what all methods share.

    Parameters
    ----------
    result : FitResult
        Fit of output error or filter error.
    maneuvers : sequence of Maneuver
        What it was fitted to.
    """
    samples, outputs = sum(m.samples for m in maneuvers), len(result.model.outputs)
    cost, count = float(np.asarray(result.details["cost"])), float(len(result.estimate))
    if result.residual_kind == "output":  # its variances are concentrated out
        cost += 0.5 * measurements(maneuvers)
        count += outputs + float(np.sum(np.asarray(result.details["noise_orders"])))
    return 2.0 * cost + count * float(np.log(samples))
