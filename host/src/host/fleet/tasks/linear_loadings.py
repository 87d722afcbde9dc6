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
from host.instrument.error_list import VANE, conversion_cause, error_kinds
from host.instrument.instrument_errors import InstrumentErrors
from host.sysid.aerodynamics import CoefficientParts
from host.sysid.linear import Answer


def linear_loadings(answers: Sequence[Answer], errors: InstrumentErrors) -> LoadedEstimates:
    """Return the parts of the coefficients of linear answers of one flight.

    Parameters
    ----------
    answers : sequence of Answer
        Answers for different axes. Those without coefficients say nothing.
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
            if error in error_kinds():
                shifts.setdefault(error, np.zeros(len(names)))[here] = shift
            else:  # an error of the model in this flight, not of a sensor
                own[here, here] += np.outer(shift, shift)
    values = np.concatenate([parts.values for parts in estimated]) if estimated else np.zeros(0)
    total = own + sum((np.outer(s, s) for s in shifts.values()), np.zeros_like(own))
    return split_covariance(names, values, total, shifts, errors)


def _shifts(parts: CoefficientParts) -> dict[str, Array]:
    """Return the shifts by one deviation of every error.

    Vane errors and upwash together have the larger of the variances sensed and assumed.
    """
    found = dict(parts.sensed)
    vanes = [shift**2 for error, shift in parts.sensed if conversion_cause(error) == VANE]
    for error, shift in parts.assumed.items():
        left = shift
        if conversion_cause(error) == VANE and vanes:
            left = np.sign(shift) * np.sqrt(np.maximum(shift**2 - np.sum(vanes, axis=0), 0.0))
        found[error] = left
    return found
