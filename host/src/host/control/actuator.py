"""From output to surface: travel, servo and delays, and what is open of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.aircraft.file import load_measured
from host.arrays import Array
from host.control.control_error import ControlError
from host.instrument.deviations import sensor_error_model

SURFACES = {"roll": "aileron", "pitch": "elevator", "yaw": "rudder"}
# A pulse every 20 ms holds the output for that long: half of it as delay, and none of it where the
# pulse has just gone out (ArduPlane, PX4 and INAV write servos at 50 Hz unless set otherwise).
PULSE_PERIOD_S = 0.020


@dataclass(frozen=True, slots=True)
class Actuator:
    """One surface's drive.

    Attributes
    ----------
    surface : str
    travel_rad : float
        Angle at full output; `travel_share` is one standard deviation of it.
    bandwidth_hz : float
        Bandwidth of the servo as a first-order lag; `bandwidth_share` the same.
    rate_limit_radps : float
    delay_s : float
        Between the output's calculation and the servo, mean; `delay_sd_s` the same.
    servo_known : bool
        Whether the aircraft file has the servo's bandwidth.
    """

    surface: str
    travel_rad: float
    travel_share: float
    bandwidth_hz: float
    bandwidth_share: float
    rate_limit_radps: float
    delay_s: float
    delay_sd_s: float
    servo_known: bool = True

    def drawn(self, rng: np.random.Generator, count: int) -> Array:
        """Return travel (rad), bandwidth (Hz) and delay (s) of each, shape (count, 3)."""
        n = rng.standard_normal((count, 3))
        return np.column_stack(
            [
                self.travel_rad * np.exp(self.travel_share * n[:, 0]),
                self.bandwidth_hz * np.exp(self.bandwidth_share * n[:, 1]),
                np.maximum(self.delay_s + self.delay_sd_s * n[:, 2], 0.0),
            ]
        )


def actuator_of(aircraft: str, axis: str, travel_rad: float | None = None) -> Actuator:
    """Return the drive of an axis' surface from the aircraft file.

    Parameters
    ----------
    aircraft : str
        Name or file.
    axis : str
        ``roll``, ``pitch`` or ``yaw``.
    travel_rad : float, optional
        Angle at full output, in place of the file's limit of the surface.

    Raises
    ------
    ControlError
        The file has no travel and none is given.
    """
    surface = SURFACES[axis]
    loaded = load_measured(aircraft)
    travel = travel_rad
    if travel is None:
        travel = loaded.scalars.get(f"surfaces.{surface}_limit_rad", 0.0)
    if not travel > 0.0:
        raise ControlError(
            f"{aircraft}: no travel of the {surface}, which is the gain of its servo; measure the"
            f" angle at full output and add [surfaces] {surface}_limit_rad"
        )
    instrument = sensor_error_model(aircraft)
    errors = instrument.errors
    bandwidth, rate = instrument.servo
    share = "servo_bandwidth_share" if instrument.servo_hz > 0.0 else "servo_unknown_share"
    return Actuator(
        surface,
        float(travel),
        errors["servo_scale"].sigma(surface),
        bandwidth,
        errors[share].sigma(surface),
        rate,
        0.5 * PULSE_PERIOD_S,
        float(np.hypot(errors["servo_delay_s"].sigma(surface), PULSE_PERIOD_S / np.sqrt(12.0))),
        instrument.servo_hz > 0.0,
    )
