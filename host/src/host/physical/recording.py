"""What the errors of a flight depend on: measured or commanded surfaces, clock with or without
GPS.

A surface measured by a pot has no servo error. A clock fitted to GPS has only the scale error that
the fit left.
"""

from __future__ import annotations

from dataclasses import dataclass

SURFACES = ("elevator", "aileron", "rudder")
OWN, AUTOPILOT, FOREIGN = "own", "autopilot", "foreign"  # who recorded a flight


@dataclass(frozen=True, slots=True)
class Recording:
    """How the columns of one flight were recorded.

    Attributes
    ----------
    commanded : tuple of str
        Surfaces whose column is the command, because no pot measured them.
    clock_share : float or None
        One standard deviation of the clock's scale after the fit to GPS; None without GPS.
    maker : str
        ``own``: our logger; ``autopilot``: a log of PX4 or ArduPilot; ``foreign``: a table of
        others, of which no calibration of ours speaks.
    imu_lag_s : float or None
        Delay of the IMU's low-pass as the recording states it; None for that of our own IMU.
    """

    commanded: tuple[str, ...] = ()
    clock_share: float | None = 0.0
    maker: str = OWN
    imu_lag_s: float | None = None
