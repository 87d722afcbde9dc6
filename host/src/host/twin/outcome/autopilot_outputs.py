"""An autopilot's outputs for the surfaces of the twin: mixers and servo pulses, forward.

Shares are of full travel in our signs: trailing edge down and left positive. An autopilot's demand
is positive for roll right, nose up, nose right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import Array
from host.errors import UsageError
from host.twin.flight.fly import FlightRecord
from host.twin.flight.stick_commands import GAP_US, IDLE_US, NEUTRAL_US, THROW_US

RECEIVER = ("aileron", "elevator", "rudder", "throttle")  # in the order of its pulses
AIRFRAMES = ("conventional", "elevons", "vtail")


@dataclass(frozen=True, slots=True)
class Servo:
    """An output of an ArduPilot plane: its function, its ends, whether it turns the other way."""

    function: int
    low_us: float
    trim_us: float
    high_us: float
    turned: bool = False

    def pulse_us(self, demand: Array) -> Array:
        """Return pulses for a demand of -1 to 1 (a throttle's: 0 to 1), whole microseconds."""
        if self.function == 70:
            return np.round(self.low_us + demand * (self.high_us - self.low_us))
        asked = -demand if self.turned else demand
        up, down = self.high_us - self.trim_us, self.trim_us - self.low_us
        return np.round(self.trim_us + np.where(asked > 0.0, asked * up, asked * down))


# Ends and trims are uneven on purpose, so that a reader that takes 1500 for neutral fails.
ARDUPILOT: dict[str, tuple[Servo, ...]] = {
    "conventional": (
        Servo(4, 1100, 1500, 1900),
        Servo(19, 1050, 1480, 1950, turned=True),
        Servo(70, 1000, 1000, 2000),
        Servo(21, 1120, 1530, 1900, turned=True),
    ),
    "elevons": (
        Servo(77, 1080, 1490, 1920),
        Servo(78, 1100, 1510, 1900, turned=True),
        Servo(70, 1000, 1000, 2000),
    ),
    "vtail": (
        Servo(4, 1100, 1500, 1900),
        Servo(79, 1050, 1480, 1950),
        Servo(70, 1000, 1000, 2000),
        Servo(80, 1100, 1520, 1900, turned=True),
    ),
}  # fmt: skip
# PX4: CA_SV_CSn_TYPE of each control surface, and its share of roll, pitch and yaw demand.
PX4: dict[str, tuple[tuple[int, float, float, float], ...]] = {
    "conventional": ((1, -1, 0, 0), (2, 1, 0, 0), (3, 0, 1, 0), (4, 0, 0, 1)),
    "elevons": ((5, -1, 1, 0), (6, 1, 1, 0)),
    "vtail": ((1, -1, 0, 0), (2, 1, 0, 0), (7, 0, 1, 1), (8, 0, 1, -1)),
}


def demands(record: FlightRecord, at_s: Array, airframe: str) -> dict[str, Array]:
    """Return roll, pitch and yaw demand (-1 to 1) and throttle (0 to 1) at instants.

    Raises
    ------
    UsageError
        If there is no such airframe.
    """
    if airframe not in AIRFRAMES:
        raise UsageError(f"airframe {airframe!r}; expected one of {', '.join(AIRFRAMES)}")
    ends_s = np.cumsum(record.pulses_us[:, :4] + GAP_US, axis=1) * 1e-6
    share = {}
    for column, axis in enumerate(RECEIVER):
        # A servo moves when its pulse has ended, so the output is that of the last whole pulse.
        latched_s = record.pulse_starts_s + ends_s[:, column]
        row = np.maximum(np.searchsorted(latched_s, at_s, side="right") - 1, 0)
        share[axis] = record.pulses_us[row, column]
    return {
        "roll": (share["aileron"] - NEUTRAL_US) / THROW_US,
        "pitch": -(share["elevator"] - NEUTRAL_US) / THROW_US,
        "yaw": -(share["rudder"] - NEUTRAL_US) / THROW_US,
        "throttle": (share["throttle"] - IDLE_US) / (2.0 * THROW_US),
    }


def ardupilot_pulses(asked: dict[str, Array], airframe: str) -> list[Array]:
    """Return the pulse of each output (us) of an ArduPilot plane."""
    roll, pitch, yaw = asked["roll"], asked["pitch"], asked["yaw"]
    by_function = {
        4: roll, 19: pitch, 21: yaw, 70: asked["throttle"],
        77: pitch - roll, 78: pitch + roll, 79: pitch + yaw, 80: pitch - yaw,
    }  # fmt: skip
    return [
        servo.pulse_us(np.clip(by_function[servo.function], -1.0, 1.0))
        for servo in ARDUPILOT[airframe]
    ]


def px4_controls(asked: dict[str, Array], airframe: str) -> list[Array]:
    """Return the control (-1 to 1, trailing edge up or right positive) of each PX4 surface."""
    return [
        np.clip(roll * asked["roll"] + pitch * asked["pitch"] + yaw * asked["yaw"], -1.0, 1.0)
        for _, roll, pitch, yaw in PX4[airframe]
    ]
