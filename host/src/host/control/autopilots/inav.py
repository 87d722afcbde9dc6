"""INAV 7 to 9, aeroplanes: attitude error to rate demand to servo, one axis.

Law: src/main/flight/pid.c, servos.c (7.0.0 and 9.0.0), for small demands. Gains follow the airspeed
where 9.0's apa_pow is on and a pitot flies; they follow the throttle (tpa_rate) in no design here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import ClassVar

import numpy as np

from host.arrays import Array
from host.control.autopilots import parameter_table
from host.control.autopilots.parameter_table import smoothing
from host.control.autopilots.tabled import TabledAxis

FULL = 500.0  # of the axis' output: full travel
P_DIVISOR, I_DIVISOR, D_DIVISOR, FF_DIVISOR, LEVEL_DIVISOR = 31.0, 4.0, 1905.0, 31.0, 6.56
# A filter of two equal lags has its corner where its makers say it with each this much faster.
PT2_SHARE = 1.0 / math.sqrt(math.sqrt(2.0) - 1.0)
LOGGED = {
    "integral_percent": "pid_iterm_limit_percent",
    "gyro_filter_hz": "gyro_main_lpf_hz",
    "dterm_hz": "dterm_lpf_hz",
    "level_filter_hz": "fw_i_level",
    "servo_filter_hz": "servo_lpf_hz",
    "level_gain": "fw_p_level",
    "attenuation_percent": "apa_pow",
    "reference_cmps": "fw_reference_airspeed",
}


@cache
def _servo_filter(corner_hz: float, rate_hz: float) -> tuple[Array, Array]:
    """Return numerator and denominator of the biquad before the servo."""
    from scipy.signal import butter

    numerator, denominator = butter(2, corner_hz, fs=rate_hz)
    return np.asarray(numerator), np.asarray(denominator)


@dataclass(frozen=True, slots=True)
class InavLoop:
    """One axis with gains.

    States are demand, integral, last rate, slope twice and the two of the biquad.
    """

    gains: Mapping[str, float]
    fixed: Mapping[str, float]
    factor: float = 1.0  # of P, D and FF
    integral_factor: float = 1.0
    states: int = field(default=7, init=False)

    @property
    def period_s(self) -> float:
        """Period of the PID loop."""
        return 1.0 / self.fixed["loop_hz"]

    def step(self, state: Array, angle_error: Array, rate: Array) -> tuple[Array, Array]:
        """Return the new state and the output as a share of full travel."""
        g, f, dt = self.gains, self.fixed, self.period_s
        wanted = np.rad2deg(angle_error) * f["level_gain"] / LEVEL_DIVISOR
        demand = state[..., 0] + smoothing(f["level_filter_hz"], dt) * (wanted - state[..., 0])
        rate_degps = np.rad2deg(rate)
        error = demand - rate_degps
        taken = smoothing(f["dterm_hz"] * PT2_SHARE, dt)
        first = state[..., 3] + taken * ((rate_degps - state[..., 2]) / dt - state[..., 3])
        slope = state[..., 4] + taken * (first - state[..., 4])
        limit = f["integral_percent"] / 100.0 * FULL
        gain = self.integral_factor * g["I"] / I_DIVISOR
        integral = np.clip(state[..., 1] + gain * error * dt, -limit, limit)
        now = (
            g["P"] / P_DIVISOR * error + g["FF"] / FF_DIVISOR * demand - g["D"] / D_DIVISOR * slope
        )
        out = self.factor * now + integral
        (b0, b1, b2), (_, a1, a2) = _servo_filter(f["servo_filter_hz"], f["loop_hz"])
        servo = b0 * out + state[..., 5]
        kept = (b1 * out - a1 * servo + state[..., 6], b2 * out - a2 * servo)
        new = np.stack([demand, integral, rate_degps, first, slope, *kept], axis=-1)
        return new, servo / FULL


@dataclass(frozen=True)
class Inav(TabledAxis):
    """One axis of INAV.

    The attitude gain fw_p_level belongs to roll and pitch alike: it stays as it is.
    """

    trim_mps: float
    autopilot: ClassVar[str] = "inav"
    searched: ClassVar[tuple[str, ...]] = ("P", "D")

    def completed(self, chosen: Mapping[str, float], feed_forward: float) -> dict[str, float]:
        """Return every gain: FF undoes the aircraft at its trim, I restores it within a second.

        INAV's own defaults of FF and I, 50 and 7, stand in that ratio.
        """
        known = self.settings
        share = feed_forward * FULL / math.degrees(1.0)
        factor, slower = attenuation(self.trim_mps, self.fixed)
        ff = known["FF"].rounded(share * FF_DIVISOR / factor)
        i = known["I"].rounded(share * I_DIVISOR / slower)
        return {**chosen, "FF": ff, "I": i}

    def loop(self, gains: Mapping[str, float], airspeed_mps: float) -> InavLoop:
        """Return the axis with gains at an airspeed."""
        return InavLoop(dict(gains), self.fixed, *attenuation(airspeed_mps, self.fixed))


def attenuation(airspeed_mps: float, fixed: Mapping[str, float]) -> tuple[float, float]:
    """Return the factors of P, D and FF, and of I (pid.c 9.0.0); 1 where apa_pow is off."""
    power = fixed["attenuation_percent"] / 100.0
    if power <= 0.0:
        return 1.0, 1.0
    ratio = fixed["reference_cmps"] / 100.0 / airspeed_mps
    slower = float(np.clip(ratio ** (power - 1.0), 0.3, 1.5)) if power > 1.0 else 1.0
    return float(np.clip(ratio**power, 0.3, 2.0)), slower


def structure(axis: str, logged: Mapping[str, float], trim_mps: float) -> Inav:
    """Return an axis with the parameters of `diff all`, defaults where it has none.

    Parameters
    ----------
    axis : str
        ``roll`` or ``pitch``.
    logged : mapping of str to float
        Parameters by name.
    trim_mps : float
        Airspeed of the model.
    """
    fixed = parameter_table.fixed("inav", LOGGED, logged)
    if "pid_iterm_limit_percent" not in logged and "fw_iterm_throw_limit" in logged:
        fixed["integral_percent"] /= 5.0  # of 500, up to release 7
    if logged.get("looptime", 0.0) > 0.0:
        fixed["loop_hz"] = 1e6 / logged["looptime"]
    assumed = parameter_table.assumed("inav", {**LOGGED, "loop_hz": "looptime"}, logged)
    return Inav(axis, fixed, trim_mps, assumed=assumed)
