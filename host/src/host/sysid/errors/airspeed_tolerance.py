"""What an airspeed leaves open that nobody calibrated: without an aircraft file nothing carries it.

A force along an axis is the airspeed times the derivative of an angle's rate: airspeed that reads
10 % high makes Z_alpha and Y_beta 10 % small. How fast the angles turn under that force tells the
airspeed too: in calm air to 1 %, where a wrong one is seen in what the fit leaves. Gusts turn them
as well. So its scale is one more parameter next to the estimate, with what is known of the sensor
as its prior; where the data leave most of it open, the prior stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.constants import POSTERIOR_PRIOR_RATIO
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.errors.one_step import one_step_of
from host.sysid.errors.systematic_errors import is_template, retrimmed
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.templates import Trim

AIRSPEED, COLUMN = "airspeed_share", "airspeed_mps"
STEP = 0.10  # of the airspeed: beyond it the estimate is not linear in its scale


def airspeed_shift(
    result: FitResult, maneuvers: Sequence[Maneuver], trim: Trim, share: float
) -> tuple[ShiftedEstimate, ...]:
    """Return the estimate moved by one deviation of the airspeed's scale.

    Nothing of a user's own model, which has the airspeed in numbers, nor of a method that does not
    simulate.

    Parameters
    ----------
    result : FitResult
        Fit of a template about `trim`.
    maneuvers : sequence of Maneuver
        As fitted.
    trim : Trim
    share : float
        One deviation of the airspeed's scale, as known beforehand.
    """
    if share <= 0.0 or not trim.known or not is_template(result.model, trim):
        return ()
    found = one_step_of(result, maneuvers, trim)
    if found is None:
        return ()
    step = min(STEP, share)
    faster = replace(trim, airspeed_mps=trim.airspeed_mps * (1.0 + step))
    extended = [(retrimmed(result.model, faster), _reading_high(result, maneuvers, step))]
    prior = share / step
    found_step = found.joint(result.model, trim, maneuvers, extended, [prior])
    sd = float(np.sqrt(found_step.covariance[0, 0])) * found.widened_in(result)
    size = sd if sd < POSTERIOR_PRIOR_RATIO * prior else prior
    # What the fit left out stays out: no deviation of a sensor brings it back.
    fitted = np.diag(result.covariance) > 0.0
    shift = np.where(fitted, size * found_step.by_added[0], 0.0)
    return (ShiftedEstimate(AIRSPEED, result.estimate + shift, 1.0, 1.0),)


def _reading_high(
    result: FitResult, maneuvers: Sequence[Maneuver], share: float
) -> Sequence[Maneuver]:
    """Return maneuvers whose measured airspeed is that share larger."""
    outputs = result.model.outputs
    if COLUMN not in outputs:
        return maneuvers
    gain = np.where(np.array(outputs) == COLUMN, 1.0 + share, 1.0)
    return [replace(m, outputs=m.outputs * gain) for m in maneuvers]
