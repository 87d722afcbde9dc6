"""What widens each interval of a linear model most: noise, what the model leaves, a known error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.instrument.error_list import error_label
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.models.fit_result import FitResult
from host.sysid.models.uncertainty import Uncertainty, dominant_error_source

NOISE = "noise and gusts"
OUTSIDE_MODEL = "maneuvers that differ, motion outside the model"


def widest_errors(
    fit: FitResult, statistical: FitResult, total: Uncertainty, shifts: Sequence[ShiftedEstimate]
) -> dict[str, str]:
    """Return the largest cause of the variance of each parameter; none where nothing causes a
    quarter of it.

    Parameters
    ----------
    fit : FitResult
        As estimated: noise alone.
    statistical : FitResult
        With scatter of the maneuvers and what inputs drive outside the model.
    total : Uncertainty
        With the systematic errors.
    shifts : sequence of ShiftedEstimate
        Shift by one deviation of each systematic error.
    """
    noise = np.diag(fit.covariance)
    parts = {NOISE: noise, OUTSIDE_MODEL: np.maximum(np.diag(statistical.covariance) - noise, 0.0)}
    for shift in shifts:
        label = error_label(shift.error)
        moved = (shift.estimate - statistical.estimate) ** 2
        parts[label] = parts.get(label, np.zeros(len(noise))) + moved
    variance = total.variance
    causes = {
        name: dominant_error_source({c: float(p[k]) for c, p in parts.items()}, float(variance[k]))
        for k, name in enumerate(statistical.names)
    }
    return {name: cause for name, cause in causes.items() if cause}
