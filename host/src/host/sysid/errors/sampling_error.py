"""What sampling leaves open: an input between its samples.

A record says what an input was at its samples. Between them it was held, or moved on; the estimate
moves by the difference. How far the data go from one hold to the other they tell themselves: that
share is one more parameter next to the estimate. Where that moves the estimate by more than a tenth
of an interval it is part of it. On records without noise it is most of it.

Surfaces that move between samples as servos do are those of `surface_motion`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import special

from host.constants import NORMAL_95
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.errors.one_step import OneStep, one_step_of
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.templates import Trim
from host.sysid.numerics.between_samples import (
    OTHER_HOLD,
)

HOLD = "inputs between samples"
NEGLIGIBLE = 0.1  # of a half-width
ONE_STEP = 1.1  # times what one step of Gauss and Newton says: the next ones may add a tenth
NORMAL_99 = 2.576


def hold_shift(
    result: FitResult, maneuvers: Sequence[Maneuver], trim: Trim
) -> tuple[ShiftedEstimate, ...]:
    """Return the estimate moved by what lies between samples, one deviation of a normal error each.

    Nothing where that is less than a tenth of every half-width, or the method does not simulate.

    Parameters
    ----------
    result : FitResult
        Its half-widths count noise.
    maneuvers : sequence of Maneuver
        That were fitted.
    trim : Trim
    """
    if result.residual_kind not in ("output", "innovation") or any(
        y.shape != m.outputs.shape for y, m in zip(result.fitted, maneuvers, strict=True)
    ):
        return ()
    # Half a sample is no delay of a sensor: its bound does not hold here.
    delays = [d.name for d in result.model.delays]
    found = one_step_of(result, maneuvers, trim, delays)
    if found is None:
        return ()
    other = replace(result.model, hold=OTHER_HOLD[result.model.hold])
    whole = found.change(other, trim, maneuvers).sum(axis=0)
    step = ONE_STEP / NORMAL_95 * whole * _share(result, found, trim, maneuvers)
    if not np.any(NORMAL_95 * np.abs(step) > NEGLIGIBLE * result.half_width()):
        return ()
    return (ShiftedEstimate(HOLD, result.estimate + step, 1.0, 1.0),)


def _share(result: FitResult, found: OneStep, trim: Trim, maneuvers: Sequence[Maneuver]) -> float:
    """Return how far from this hold to the other the input may have been: at most all the way.

    As far as the data say where they contradict this hold at 1 %; else by the odds of the other
    one. The deviation of the share counts noise as white; where an interval of the result is wider
    than that its own is widened alike.
    """
    other = replace(result.model, hold=OTHER_HOLD[result.model.hold])
    step = found.joint(result.model, trim, maneuvers, [(other, maneuvers)], [1.0])
    wider = found.widened_in(result)
    share, sd = float(step.added[0]), float(np.sqrt(max(step.covariance[0, 0], 0.0)) * wider)
    if abs(share) > NORMAL_99 * sd:
        return float(min(np.hypot(share, NORMAL_95 * sd), 1.0))
    odds = special.expit((share - 0.5) / max(sd, 1e-9) ** 2)
    return float(min(NORMAL_95 * np.sqrt(odds), 1.0))
