"""A PX4 tailsitter's axes: those of hover, nose up, in the whole log.

x of hover is z of forward flight, z of hover is minus x: as its rate controller turns them before a
wing's law and back behind it (FixedwingRateControl.cpp). One turn holds for the whole log, for in
hover a wing is but pitched up by 90 degrees.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.readers.autopilot_log import AutopilotLog

FIELD = "is_vtol_tailsitter"
MAV_TYPES = (19, 20, 23)  # VTOL_TAILSITTER_DUOROTOR, _QUADROTOR and VTOL_TAILSITTER
NOTE = "a tailsitter ({}): its axes are turned from hover to forward flight"
_HALF = np.sqrt(0.5)


def tailsitter(log: AutopilotLog) -> str:
    """Return by what a log is one of a tailsitter; empty if it is none."""
    status = log.first("vehicle_status")
    if status is not None and FIELD in status.fields:
        return FIELD if np.any(np.asarray(status.fields[FIELD]) == 1) else ""
    return "MAV_TYPE" if log.parameters.get("MAV_TYPE", 0.0) in MAV_TYPES else ""


def forward_flight(hover: Sequence[Array]) -> list[Array]:
    """Return x, y, z of a vector in axes of forward flight."""
    x, y, z = hover
    return [-z, y, x]


def forward_attitude(hover: Sequence[Array]) -> list[Array]:
    """Return the quaternion w, x, y, z of the axes of forward flight: those of hover, turned by 90
    degrees about y."""
    w, x, y, z = (_HALF * part for part in hover)
    return [w - y, x - z, w + y, x + z]
