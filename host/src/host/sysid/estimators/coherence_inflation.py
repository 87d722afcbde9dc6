"""Intervals of a fit whose residual the inputs drive: widened by what the model lacks.

Noise that a model's error was taken for narrows the interval two to three times. Where the inputs
drive the residual (`numerics.input_coherence`), its power above noise counts in the covariance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.models.fit_result import FitResult
from host.sysid.numerics.input_coherence import InputCoherence

REPORTED_FACTOR = 1.05  # times wider
COUNTED = "driven_by_inputs"  # among the details of a result that was widened


def inflate_by_coherence(result: FitResult, found: InputCoherence | None) -> FitResult:
    """Return the result with intervals that hold what the inputs drive beside the model.

    They are widened where that is suspected at 10 %, and it is said at 1 %.

    Output error is widened to the covariance of that residual, other methods by its ratio to the
    covariance in noise alone; no interval becomes narrower. The degrees of freedom are those of the
    columns that showed it.

    Parameters
    ----------
    result : FitResult
    found : InputCoherence or None
        Of its free simulation. Nothing changes without, or if no output is coherent.
    """
    if found is None or not found.suspected or COUNTED in result.details:
        return result
    count = len(result.model.parameter_names)
    own = np.diag(result.covariance)[:count]
    wide = np.diag(found.widened_covariance())[:count]
    if result.residual_kind == "output":
        ratio = wide / np.maximum(own, 1e-300)
    else:
        ratio = wide / np.maximum(np.diag(found.covariance())[:count], 1e-300)
    factor = np.ones(len(result.covariance))
    factor[:count] = np.where(own > 0.0, np.sqrt(np.maximum(ratio, 1.0)), 1.0)
    freedom = result.degrees_of_freedom.copy()
    columns = [c for n, c in zip(found.outputs, found.columns, strict=True) if n in found.suspected]
    widened = np.flatnonzero(factor > 1.0)
    freedom[widened] = np.minimum(freedom[widened], max(min(columns), 1.0))
    return replace(
        result,
        covariance=result.covariance * np.outer(factor, factor),
        degrees_of_freedom=freedom,
        warnings=(*result.warnings, *_lines(result, found, factor)),
        details={**result.details, COUNTED: factor},
    )


def _lines(result: FitResult, found: InputCoherence, factor: Array) -> list[str]:
    if not found.coherent:
        return []
    widened = ", ".join(
        f"{p.name} {times:.1f}"
        for p, times in zip(result.model.parameters, factor, strict=False)
        if times >= REPORTED_FACTOR and not p.name.startswith("imu_")
    )
    like = f", most like {found.likely_error}" if found.likely_error else ""
    times = f"intervals widened {widened} times" if widened else "intervals hold it already"
    return [f"the inputs drive what the fit leaves of {', '.join(found.coherent)}{like}: {times}"]
