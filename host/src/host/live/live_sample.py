"""What the stream hands to its consumers: rows of channels, and frames of the slower kinds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.link.status_line import StatusLine
from host.live.gps_fix import GpsFix

Array = NDArray[np.float64]

# Columns of the page: name -> unit. Angles in degrees, as pilots read them.
LIVE_UNITS = {
    "t_s": "s",
    **dict.fromkeys(("alpha_a_deg", "alpha_b_deg", "beta_a_deg", "beta_b_deg"), "deg"),
    **dict.fromkeys(("airspeed_a_mps", "airspeed_b_mps"), "m/s"),
    **dict.fromkeys(("p_degps", "q_degps", "r_degps"), "deg/s"),
    **dict.fromkeys(("phi_deg", "theta_deg", "psi_deg"), "deg"),
    **dict.fromkeys(("ax_mps2", "ay_mps2", "az_mps2"), "m/s2"),
    **dict.fromkeys(
        ("elevator_pot_deg", "aileron_left_deg", "aileron_right_deg", "rudder_pot_deg"), "deg"
    ),
    **dict.fromkeys(
        (f"rc_{name}_us" for name in ("elevator", "aileron", "rudder", "throttle")), "us"
    ),
    **dict.fromkeys(
        (f"servo_{name}_us" for name in ("elevator", "aileron", "rudder", "throttle")), "us"
    ),
    "rc_switch_us": "us",
    "altitude_m": "m",  # above the level of 101325 Pa
    "height_m": "m",  # over the start
}


@dataclass(frozen=True, slots=True)
class SlowFrame:
    """A frame of another kind than identification.

    Parameters
    ----------
    name : str
        Name in the schema, such as ``gps``.
    row : numpy.void
        Its fields, raw.
    t_s : float
        On the clock of the rows.
    """

    name: str
    row: Any
    t_s: float


@dataclass(frozen=True, slots=True)
class LiveUpdate:
    """What one portion of the stream held.

    Parameters
    ----------
    rows : dict of str to Array, each of shape (n,)
        The columns of `LIVE_UNITS`; NaN where a channel has no valid value.
    mega_drives : NDArray[np.bool_], shape (n,)
    lost : int
        Identification frames that did not arrive before these.
    slow : list of SlowFrame
    arrived_s : float
        When the portion was read, on the clock of `time.time`.
    fixes : list of GpsFix
        New positions, on the clock of the rows.
    messages : list of str
        What a person should know.
    status : StatusLine or None
        The newest status line in it: USB has one a second, the radio none.
    """

    rows: dict[str, Array]
    mega_drives: NDArray[np.bool_]
    lost: int
    slow: list[SlowFrame]
    arrived_s: float
    messages: list[str] = field(default_factory=list)
    fixes: list[GpsFix] = field(default_factory=list)
    status: StatusLine | None = None

    def __len__(self) -> int:
        return len(self.rows["t_s"]) if self.rows else 0
