"""PX4's rudder: a yaw rate loop on the rate of a coordinated turn, and roll torque's share.

Law: fw_att_control/fw_yaw_controller.cpp asks g / V of the bank; fw_rate_control flies it as it
does roll and pitch, and adds FW_RLL_TO_YAW_FF of the roll torque.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from host.constants import GRAVITY_MPS2
from host.control.autopilots import parameter_table
from host.control.autopilots.px4 import (
    INTEGRAL_LIMITS,
    LOGGED,
    Px4Loop,
    share_per_torque,
    speed_scale,
)
from host.control.autopilots.tabled import TabledRudder


@dataclass(frozen=True)
class Px4Yaw(TabledRudder):
    """Rudder of PX4."""

    trim_mps: float
    autopilot: ClassVar[str] = "px4"
    damper: ClassVar[str] = "P"

    def completed(self, damper: float, mix: float, feed_forward: float) -> dict[str, float]:
        """Return every gain: FF holds the trim's turn; FW_YR_I, in steps of 0.5, stays."""
        known = self.settings["FF"]
        ff = known.rounded(feed_forward / (self.share * speed_scale(self.trim_mps, self.fixed)))
        return {"FF": ff, "P": damper, "MIX": mix}

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> Px4Loop:
        """Return the yaw loop with gains at an airspeed."""
        flown = max(airspeed_mps, self.fixed["airspeed_stall_mps"])
        # What is asked is g / V of the bank itself, where roll asks 1 / TC of its error.
        fixed = {"I": self.fixed["yaw_integral"], "D": 0.0, "TC": -flown / GRAVITY_MPS2}
        return Px4Loop(
            {**gains, **fixed}, speed_scale(airspeed_mps, self.fixed), self.fixed, self.share
        )


def structure(logged: Mapping[str, float], trim_mps: float) -> Px4Yaw:
    """Return the rudder with the parameters of a log, defaults where it has none.

    Parameters
    ----------
    logged : mapping of str to float
        Parameters of the log by name.
    trim_mps : float
        Airspeed of the model.
    """
    names = {**LOGGED, "yaw_integral": "FW_YR_I"}
    fixed = parameter_table.fixed("px4", names, logged)
    name, usual = INTEGRAL_LIMITS["yaw"]
    fixed["integral_torque"] = logged.get(name, usual)
    shares = share_per_torque("yaw", logged), share_per_torque("roll", logged)
    return Px4Yaw(fixed, *shares, trim_mps)
