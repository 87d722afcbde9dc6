"""How a flight was recorded, as far as its errors depend on it: surfaces commanded, clock checked.

Where a pot measured a surface, no error of its servo is in the data; where GPS fitted the clock,
what the fit left is all that stays open of its scale.
"""

from __future__ import annotations

from dataclasses import dataclass

SURFACES = ("elevator", "aileron", "rudder")
OWN, AUTOPILOT, FOREIGN = "own", "autopilot", "foreign"  # who recorded a flight


@dataclass(frozen=True, slots=True)
class Recording:
    """Which errors are in the columns of one flight.

    Attributes
    ----------
    commanded : tuple of str
        Of `SURFACES`, those whose column is the command: no pot measured them.
    clock_share : float or None
        One standard deviation of the clock's scale as GPS left it; None: nothing checked the
        instrument's own clock.
    maker : str
        ``own``: our logger; ``autopilot``: a log of PX4 or ArduPilot; ``foreign``: a table of
        others, of which no calibration of ours speaks.
    imu_lag_s : float or None
        Delay of the IMU's low-pass as the recording says it; None: that of our own.
    """

    commanded: tuple[str, ...] = ()
    clock_share: float | None = 0.0
    maker: str = OWN
    imu_lag_s: float | None = None
