"""ArduPlane 4.1 and later: attitude error to rate demand to surface, one axis.

Law: APM_Control/AP_FW_Controller.cpp, AC_PID/AC_PID.cpp (4.7-dev 2598e9d). Its output in degrees is
a share of 45, whatever angle the surface has there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from host.arrays import Array
from host.control.autopilots import parameter_table
from host.control.autopilots.parameter_table import smoothing
from host.control.autopilots.tabled import TabledAxis
from host.control.control_error import ControlError

ELEVONS, V_TAIL = {77, 78}, {79, 80}  # SERVOn_FUNCTION
MIXED = {"roll": ELEVONS, "pitch": ELEVONS | V_TAIL, "yaw": V_TAIL}
MIXING_GAIN = 0.5  # its default
FULL_RAD = math.pi / 4.0  # of the controllers' output: 45 notional degrees


def speed_scaler(airspeed_mps: float, fixed: Mapping[str, float]) -> float:
    """Return SCALING_SPEED over the airspeed within its limits (ArduPlane/Attitude.cpp)."""
    reference = fixed["scaling_speed_mps"]
    lowest = min(0.5, reference / (2.0 * fixed["airspeed_max_mps"]))
    highest = max(2.0, reference / (0.7 * fixed["airspeed_min_mps"]))
    return float(np.clip(reference / airspeed_mps, lowest, highest))


@dataclass(frozen=True, slots=True)
class ArduPlaneLoop:
    """One axis with gains at an airspeed; states are T, E, its derivative and the integral."""

    gains: Mapping[str, float]
    scaler: float
    fixed: Mapping[str, float]
    share: float = 1.0
    states: int = field(default=4, init=False)

    @property
    def period_s(self) -> float:
        """Period of the main loop."""
        return 1.0 / self.fixed["loop_hz"]

    def step(self, state: Array, angle_error: Array, rate: Array) -> tuple[Array, Array]:
        """Return the new state and the output as a share of full travel."""
        g, s, dt = self.gains, self.scaler, self.period_s

        def share(name: str) -> float:
            return smoothing(self.fixed[name], dt)

        demand = angle_error / g["TC"]
        target = state[..., 0] + share("FLTT_hz") * (s * s * demand - state[..., 0])
        error = state[..., 1] + share("FLTE_hz") * (target - s * s * rate - state[..., 1])
        slope = (error - state[..., 1]) / dt
        derivative = state[..., 2] + share("FLTD_hz") * (slope - state[..., 2])
        limit = self.fixed["integral_rad"]
        integral = np.clip(state[..., 3] + g["I"] * error * dt, -limit, limit)
        out = g["FF"] * target / s + g["P"] * error + g["D"] * derivative + integral
        return np.stack([target, error, derivative, integral], axis=-1), out / FULL_RAD * self.share


@dataclass(frozen=True)
class ArduPlane(TabledAxis):
    """One axis of ArduPlane.

    Attributes
    ----------
    trim_mps : float
        Airspeed of the model.
    share : float
        Share of the surface's travel that full output is, below 1 where a mixer halves it.
    """

    trim_mps: float
    share: float = 1.0
    autopilot: ClassVar[str] = "ardupilot"

    def completed(self, chosen: Mapping[str, float], feed_forward: float) -> dict[str, float]:
        """Return every gain: FF undoes the aircraft at its trim, I is as AUTOTUNE sets it.

        AP_AutoTune.cpp: roll min(P, FF / 1 s), pitch max(0.75 P, FF / 1 s).
        """
        known = self.settings
        # FF T / s with T = s^2 w: the scaler stands once in it.
        factor = FULL_RAD / (speed_scaler(self.trim_mps, self.fixed) * self.share)
        ff = known["FF"].rounded(feed_forward * factor)
        p = chosen["P"]
        i = min(p, ff) if self.axis == "roll" else max(0.75 * p, ff)
        return {**chosen, "FF": ff, "I": known["I"].rounded(i)}

    @property
    def slew_limit_per_s(self) -> float:
        """Slew limit by x_RATE_SMAX, beyond which P and D are turned down; 0 is none.

        The limiter sees 45 times P and D in radians (AC_PID.cpp).
        """
        limit = self.fixed["slew_degps"] / 45.0
        return limit / FULL_RAD * self.share if limit > 0.0 else math.inf

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> ArduPlaneLoop:
        """Return the axis with gains at an airspeed."""
        scaler = speed_scaler(airspeed_mps, self.fixed)
        return ArduPlaneLoop(dict(gains), scaler, self.fixed, self.share)


# What a log says of the parameters that stay, by their names in it.
LOGGED = {
    "integral_rad": "{}_RATE_IMAX",
    "slew_degps": "{}_RATE_SMAX",
    "FLTT_hz": "{}_RATE_FLTT",
    "FLTE_hz": "{}_RATE_FLTE",
    "FLTD_hz": "{}_RATE_FLTD",
    "gyro_filter_hz": "INS_GYRO_FILTER",
    "loop_hz": "SCHED_LOOP_RATE",
    "scaling_speed_mps": "SCALING_SPEED",
    "airspeed_min_mps": "AIRSPEED_MIN",
    "airspeed_max_mps": "AIRSPEED_MAX",
}
PREFIX = {"roll": "RLL", "pitch": "PTCH"}


def structure(axis: str, logged: Mapping[str, float], trim_mps: float) -> ArduPlane:
    """Return an axis with the parameters of a log, defaults where it has none.

    Parameters
    ----------
    axis : str
        ``roll`` or ``pitch``.
    logged : mapping of str to float
        Parameters of the log by name.
    trim_mps : float
        Airspeed of the model.

    Raises
    ------
    ControlError
        The log is of a release before 4.1, whose law is another.
    """
    old, new = f"{PREFIX[axis]}2SRV_P", f"{PREFIX[axis]}_RATE_P"
    if old in logged and new not in logged:
        raise ControlError(
            f"the parameters have {old} and no {new}: ArduPlane before 4.1 flies another law;"
            " update it, and save its parameters again"
        )
    names = {key: name.format(PREFIX[axis]) for key, name in LOGGED.items()}
    fixed = parameter_table.fixed("ardupilot", names, logged)
    assumed = parameter_table.assumed("ardupilot", names, logged)
    return ArduPlane(axis, fixed, trim_mps, mixer_share(axis, logged), assumed=assumed)


def mixer_share(axis: str, logged: Mapping[str, float]) -> float:
    """Return the share of travel that one axis of elevons or of a V-tail has at full output.

    servos.cpp: each side is the sum of two axes times MIXING_GAIN.
    """
    functions = {int(v) for name, v in logged.items() if re.fullmatch(r"SERVO\d+_FUNCTION", name)}
    mixed = functions & MIXED[axis]
    return logged.get("MIXING_GAIN", MIXING_GAIN) if mixed else 1.0
