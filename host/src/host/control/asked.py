"""What tuning is asked for, refused before minutes of work."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.control.autopilots.known import AUTOPILOTS
from host.control.control_error import ControlError
from host.control.releases import release_note


def check_asked(autopilot: str, release: str, airspeeds_mps: Sequence[float]) -> None:
    """Refuse what no flight can answer.

    Raises
    ------
    ControlError
        An autopilot that is not known, a release whose law was not read, no airspeed.
    """
    if autopilot not in AUTOPILOTS:
        raise ControlError(f"autopilot '{autopilot}', expected {', '.join(AUTOPILOTS)}")
    wrong = [f"{v:g}" for v in airspeeds_mps if not 0.0 < v < np.inf]
    if wrong:
        raise ControlError(f"airspeed {', '.join(wrong)} m/s, expected a positive number")
    if release:
        release_note(autopilot, release)
