"""PX4 fixed wing 1.14 to 1.16: attitude error to rate demand to torque, one axis.

Law: fw_rate_control/FixedwingRateControl.cpp, lib/rate_control/rate_control.cpp, fw_att_control
(main of 2026-02). Torque is normalised; the allocator makes shares of travel of it. The derivative
is the gyro's, behind a first-order filter (sensors/vehicle_angular_velocity).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from host.arrays import Array
from host.control.autopilots import parameter_table
from host.control.autopilots.parameter_table import smoothing
from host.control.autopilots.tabled import TabledAxis

LOGGED = {
    "airspeed_trim_mps": "FW_AIRSPD_TRIM",
    "airspeed_stall_mps": "FW_AIRSPD_STALL",
    "scaled": "FW_ARSP_SCALE_EN",
    "dgyro_hz": "IMU_DGYRO_CUTOFF",
    "gyro_filter_hz": "IMU_GYRO_CUTOFF",
    "loop_hz": "IMU_GYRO_RATEMAX",
}
TORQUES = {axis: rf"CA_SV_CS\d+_TRQ_{axis[0].upper()}" for axis in ("roll", "pitch", "yaw")}
# Parameter of each axis with its default (fw_rate_control_params.c).
INTEGRAL_LIMITS = {
    "roll": ("FW_RR_IMAX", 0.2), "pitch": ("FW_PR_IMAX", 0.4), "yaw": ("FW_YR_IMAX", 0.2)
}  # fmt: skip
LOWEST_MPS = 0.1  # that the scale divides by


def speed_scale(airspeed_mps: float, fixed: Mapping[str, float]) -> float:
    """Return FW_AIRSPD_TRIM over the airspeed, 1 where scaling is off."""
    if not fixed["scaled"]:
        return 1.0
    least = max(fixed["airspeed_stall_mps"], LOWEST_MPS)
    return fixed["airspeed_trim_mps"] / max(airspeed_mps, least)


def share_per_torque(axis: str, logged: Mapping[str, float]) -> float:
    """Return the largest share of travel that a torque of 1 makes: the allocator's pseudo-inverse.

    Axes of one pair of elevons or of a V-tail do not mix: the sides have one sign in one and two
    in the other. Without CA_SV_CSn_TRQ_* it is 1, as the usual -0.5 and 0.5 of two ailerons and 1
    of an elevator give.
    """
    shares = [v for name, v in logged.items() if re.fullmatch(TORQUES[axis], name) and v != 0.0]
    return max(abs(v) for v in shares) / sum(v * v for v in shares) if shares else 1.0


@dataclass(frozen=True, slots=True)
class Px4Loop:
    """One axis with gains at an airspeed; states are the integral, the last rate, its slope."""

    gains: Mapping[str, float]
    scale: float
    fixed: Mapping[str, float]
    share: float
    states: int = field(default=3, init=False)

    @property
    def period_s(self) -> float:
        """Period of the gyro's publications."""
        return 1.0 / self.fixed["loop_hz"]

    def step(self, state: Array, angle_error: Array, rate: Array) -> tuple[Array, Array]:
        """Return the new state and the output as a share of full travel."""
        g, s, dt = self.gains, self.scale, self.period_s
        demand = angle_error / g["TC"]
        error = demand - rate
        taken = smoothing(self.fixed["dgyro_hz"], dt)
        slope = state[..., 2] + taken * ((rate - state[..., 1]) / dt - state[..., 2])
        # The integral of the step before: it is updated behind the output.
        torque = s * s * (g["P"] * error + state[..., 0] - g["D"] * slope) + s * g["FF"] * demand
        limit = self.fixed["integral_torque"]
        integral = np.clip(state[..., 0] + g["I"] * error * dt, -limit, limit)
        return np.stack([integral, rate, slope], axis=-1), torque * self.share


@dataclass(frozen=True)
class Px4(TabledAxis):
    """One axis of PX4: share of travel that a torque of 1 makes, airspeed of the model."""

    share: float
    trim_mps: float
    autopilot: ClassVar[str] = "px4"

    def completed(self, chosen: Mapping[str, float], feed_forward: float) -> dict[str, float]:
        """Return every gain: FF undoes the aircraft at its trim, I restores it within a second.

        PX4 documents no rule for I; that of ArduPlane's AUTOTUNE stands in (FF / 1 s).
        """
        known = self.settings
        torque = feed_forward / (self.share * speed_scale(self.trim_mps, self.fixed))
        ff = known["FF"].rounded(torque)
        return {**chosen, "FF": ff, "I": known["I"].rounded(torque)}

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> Px4Loop:
        """Return the axis with gains at an airspeed."""
        return Px4Loop(dict(gains), speed_scale(airspeed_mps, self.fixed), self.fixed, self.share)


def structure(axis: str, logged: Mapping[str, float], trim_mps: float) -> Px4:
    """Return an axis with the parameters of a log, defaults where it has none.

    Parameters
    ----------
    axis : str
        ``roll`` or ``pitch``.
    logged : mapping of str to float
        Parameters of the log by name.
    trim_mps : float
        Airspeed of the model.
    """
    name, usual = INTEGRAL_LIMITS[axis]
    fixed = parameter_table.fixed("px4", LOGGED, logged)
    fixed["integral_torque"] = logged.get(name, usual)
    assumed = parameter_table.assumed("px4", {**LOGGED, "integral_torque": name}, logged)
    return Px4(axis, fixed, share_per_torque(axis, logged), trim_mps, assumed=assumed)
