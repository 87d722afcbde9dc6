"""Noise of measured columns that drive a user's equations: what output error leaves uncounted.

Output error takes inputs for true. Rates and specific forces that drive a path carry noise, which
the states add up: without, intervals of the gyro's zero hold in 5 of 8 flights. Columns are drawn
anew with noise as large as their own, and how far the estimate moves counts in its covariance. A
filter's process noise stands for it already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.sysid.errors.one_step import one_step_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import has_equations
from host.sysid.models.templates import Trim
from host.sysid.models.uncertainty import consider_covariance
from host.sysid.numerics.white_noise import white_deviation

DRAWS, DRAW_SEED = 40, 3


def column_noise(result: FitResult, maneuvers: Sequence[Maneuver], trim: Trim) -> Array:
    """Return what the noise of measured columns adds to the covariance of output error, (P, P).

    Parameters
    ----------
    result : FitResult
        Results of other methods, and of models without columns, get nothing added.
    maneuvers : sequence of Maneuver
        That were fitted.
    trim : Trim
    """
    model, none = result.model, np.zeros_like(result.covariance)
    if not has_equations(model) or result.residual_kind != "output":
        return none
    deviation = white_deviation([m.inputs for m in maneuvers])
    deviation[: model.source.controls] = 0.0  # surfaces: `sampling_error`
    found = one_step_of(result, maneuvers, trim) if np.any(deviation) else None
    if found is None:
        return none
    rng = np.random.default_rng(DRAW_SEED)
    moved = np.zeros((DRAWS, len(result.estimate)))
    for row in moved:
        drawn = [
            replace(m, inputs=m.inputs + deviation * rng.standard_normal(m.inputs.shape))
            for m in maneuvers
        ]
        row[:] = found.change(model, trim, drawn).sum(axis=0)
    return consider_covariance(moved / np.sqrt(DRAWS))
