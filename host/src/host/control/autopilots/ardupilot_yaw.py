"""ArduPlane's rudder: yaw damper and aileron's share, next to the roll loop.

Law: APM_Control/AP_YawController.cpp, ArduPlane/Attitude.cpp (4.7-dev 2598e9d). YAW2SRV_INT and
YAW2SRV_SLIP stay 0, YAW2SRV_RLL 1, as they are by default.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.control.autopilots import parameter_table
from host.control.autopilots.ardupilot import FULL_RAD, LOGGED, PREFIX, mixer_share, speed_scaler
from host.control.autopilots.tabled import TabledRudder

WASHED_OUT = 0.003992  # a step, whatever the loop's rate: 0.2 rad/s at 50 Hz


@dataclass(frozen=True, slots=True)
class ArduPlaneYawLoop:
    """The damper at an airspeed; states are the last rate beyond the turn's and the high-pass."""

    damping: float
    turn_per_bank: float
    period_s: float
    states: int = field(default=2, init=False)

    def step(self, state: Array, angle_error: Array, rate: Array) -> tuple[Array, Array]:
        """Return the new state and the rudder as a share of full travel, right positive."""
        beyond = rate + self.turn_per_bank * angle_error
        kept = state[..., 1] + beyond - state[..., 0] - WASHED_OUT * state[..., 1]
        return np.stack([beyond, kept], axis=-1), -self.damping * kept


@dataclass(frozen=True)
class ArduPlaneYaw(TabledRudder):
    """Rudder of ArduPlane."""

    autopilot: ClassVar[str] = "ardupilot"
    damper: ClassVar[str] = "DAMP"

    def completed(self, damper: float, mix: float, feed_forward: float) -> dict[str, float]:
        """Return every gain; the damper has no feed-forward."""
        return {"DAMP": damper, "MIX": mix}

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> ArduPlaneYawLoop:
        """Return the damper with gains at an airspeed."""
        scaler = speed_scaler(airspeed_mps, self.fixed)
        damping = gains["DAMP"] * scaler**2 / FULL_RAD * self.share
        slowest = max(airspeed_mps, self.fixed["airspeed_min_mps"])
        return ArduPlaneYawLoop(damping, GRAVITY_MPS2 / slowest, 1.0 / self.fixed["loop_hz"])


def structure(logged: Mapping[str, float], trim_mps: float) -> ArduPlaneYaw:
    """Return the rudder with the parameters of a log, defaults where it has none.

    Parameters
    ----------
    logged : mapping of str to float
        Parameters of the log by name.
    trim_mps : float
        Airspeed of the model; the scaler follows the airspeed itself.
    """
    names = {key: name.format(PREFIX["roll"]) for key, name in LOGGED.items()}
    fixed = parameter_table.fixed("ardupilot", names, logged)
    return ArduPlaneYaw(fixed, mixer_share("yaw", logged), mixer_share("roll", logged))
