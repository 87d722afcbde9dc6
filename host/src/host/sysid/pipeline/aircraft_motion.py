"""Linear motion of an aircraft file, as `host identify --save-aircraft` writes it, as models."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from host.aircraft.file import load
from host.aircraft.linearisation import linearise
from host.aircraft.trim import solve
from host.sysid.coefficients.coefficient_modes import SIGNALS
from host.sysid.models.state_space_model import LinearModel
from host.sysid.pipeline.simulation import motion_model


def aircraft_models(path: Path) -> list[tuple[str, LinearModel]]:
    """Return the longitudinal and the lateral motion of an aircraft in level flight at its trim.

    Parameters
    ----------
    path : Path
        File of an aircraft with coefficients.

    Raises
    ------
    host.errors.UsageError
        If it cannot be read, or has no trim.
    """
    aircraft = load(path)
    frame = aircraft.airframe()
    trim = solve(frame, aircraft.scalar("trim.airspeed_mps"))
    linear = linearise(frame, trim)
    V, (sine, cosine) = trim.airspeed_mps, (np.sin(trim.alpha_rad), np.cos(trim.alpha_rad))
    # From u, w to airspeed and angle of attack, from v to sideslip.
    along, across = np.eye(4), np.eye(4)
    along[:2, :2] = [[cosine, sine], [-sine / V, cosine / V]]
    across[0, 0] = 1.0 / V
    parts = {
        "longitudinal": (along, linear.longitudinal_a, linear.longitudinal_b),
        "lateral": (across, linear.lateral_a, linear.lateral_b),
    }
    return [
        (name, motion_model(name, *SIGNALS[name], turn @ A @ np.linalg.inv(turn), turn @ B))
        for name, (turn, A, B) in parts.items()
    ]
