"""Coefficients of linear models in two parts, for flights without vanes, as an autopilot's.

Their intervals are those of `host identify`: Student's quantile of few maneuvers is in the flight's
own covariance. Both axes are of one flight, so that one error shifts the coefficients of both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.fleet.tasks.estimate_loadings import LoadedEstimates, split_covariance
from host.instrument.error_labels import ERROR_LABELS
from host.instrument.instrument_errors import InstrumentErrors
from host.sysid.aerodynamics.coefficient_table import QBAR, SHARED, VANE, CoefficientParts
from host.sysid.linear import Answer

# As the coefficients' own fit calls them: flights of both kinds share an error by its name.
_ASSUMED = {
    "mass": "mass_share", "Ixx": "ixx_share", "Iyy": "iyy_share", "Izz": "izz_share",
    QBAR: "pitot_scale", VANE: "upwash_share",
}  # fmt: skip
_SENSED = {
    **{f"gyro_bias_{axis}_radps": f"gyro_{axis}_bias_radps" for axis in "xyz"},
    **{f"gyro_scale_{axis}": f"gyro_{axis}_scale" for axis in "xyz"},
    **{f"accel_bias_{axis}_mps2": f"accel_{axis}_bias_mps2" for axis in "xyz"},
    **{f"accel_scale_{axis}": f"accel_{axis}_scale" for axis in "xyz"},
    **{f"imu_tilt_{axis}_rad": f"tilt_{axis}_rad" for axis in "xyz"},
}


def linear_loadings(answers: Sequence[Answer], errors: InstrumentErrors) -> LoadedEstimates:
    """Return the parts of the coefficients of linear answers of one flight.

    Parameters
    ----------
    answers : sequence of Answer
        Of different axes. Those without coefficients say nothing.
    errors : InstrumentErrors
    """
    estimated = [a.coefficient_parts for a in answers if a.coefficient_parts is not None]
    names = tuple(name for parts in estimated for name in parts.names)
    own = np.zeros((len(names), len(names)))
    shifts: dict[str, Array] = {}
    at = 0
    for parts in estimated:
        here = slice(at, at := at + len(parts.names))
        wider = parts.quantile / NORMAL_95
        own[here, here] = parts.statistical * np.outer(wider, wider)
        for error, shift in _shifts(parts).items():
            if error in ERROR_LABELS or error in _SENSED.values() or error in _ASSUMED.values():
                shifts.setdefault(error, np.zeros(len(names)))[here] = shift
            else:  # an error of the model in this flight, not of a sensor
                own[here, here] += np.outer(shift, shift)
    values = np.concatenate([parts.values for parts in estimated]) if estimated else np.zeros(0)
    total = own + sum((np.outer(s, s) for s in shifts.values()), np.zeros_like(own))
    return split_covariance(names, values, total, shifts, errors)


def _shifts(parts: CoefficientParts) -> dict[str, Array]:
    (
        """Return the shifts by one deviation of every error.

    Vane errors and upwash together have the larger of the variances sensed and assumed.
    """
        ""
    )
    found = {_SENSED.get(error, error): shift for error, shift in parts.sensed}
    vanes = [shift**2 for error, shift in parts.sensed if SHARED.get(error) == VANE]
    for cause, shift in parts.assumed.items():
        left = shift
        if cause == VANE and vanes:
            left = np.sign(shift) * np.sqrt(np.maximum(shift**2 - np.sum(vanes, axis=0), 0.0))
        found[_ASSUMED[cause]] = left
    return found
