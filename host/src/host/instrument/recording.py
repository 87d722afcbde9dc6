"""How a flight was recorded, as far as its errors depend on it: surfaces commanded, clock checked.

Where a pot measured a surface, no error of its servo is in the data; where GPS fitted the clock,
what the fit left is all that stays open of its scale.
"""

from __future__ import annotations

from dataclasses import dataclass

SURFACES = ("elevator", "aileron", "rudder")


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
    own : bool
        Whether our logger made it. Of a table of others no calibration of ours speaks.
    """

    commanded: tuple[str, ...] = ()
    clock_share: float | None = 0.0
    own: bool = True
