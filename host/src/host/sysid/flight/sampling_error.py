"""What sampling leaves open: an input between its samples.

A record says what an input was at its samples. Between them it was held, or moved on; the estimate
moves by the difference. Where that is more than a tenth of an interval it is part of it. On records
without noise it is most of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.constants import NORMAL_95
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.flight.one_step import one_step_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.templates import Trim

HOLD = "inputs between samples"
NEGLIGIBLE = 0.1  # of a half-width
OTHER = {"foh": "zoh", "zoh": "foh"}


def hold_shift(
    result: FitResult, maneuvers: Sequence[Maneuver], trim: Trim
) -> tuple[ShiftedEstimate, ...]:
    """Return the estimate moved by what the other hold would, as one deviation of a normal error.

    Nothing where that is less than a tenth of every half-width, or the method does not simulate.

    Parameters
    ----------
    result : FitResult
        Its half-widths count noise.
    maneuvers : sequence of Maneuver
        That were fitted.
    trim : Trim
    """
    if result.residual_kind != "output" or any(
        y.shape != m.outputs.shape for y, m in zip(result.fitted, maneuvers, strict=True)
    ):
        return ()
    found = one_step_of(result, maneuvers, trim)
    if found is None:
        return ()
    other = replace(result.model, hold=OTHER[result.model.hold])
    step = found.change(other, trim, maneuvers).sum(axis=0)
    if not np.any(np.abs(step) > NEGLIGIBLE * result.half_width()):
        return ()
    return (ShiftedEstimate(HOLD, result.estimate + step / NORMAL_95, 1.0, 1.0),)
