"""Names of the errors of instrument and aircraft for people, and notes on uncertain recordings."""

from __future__ import annotations

import math

from host.constants import NORMAL_95
from host.instrument.deviations import SensorErrorModel, clock_share
from host.physical.recording import FOREIGN

ERROR_LABELS = {
    "mass_share": "mass", "ixx_share": "Ixx", "iyy_share": "Iyy", "izz_share": "Izz",
    "pitot_scale": "scale of the pitot", "pitot_zero_pa": "zero of the pitot",
    "pitot_drift_pa": "drift of the pitot", "pitot_delay_s": "delay of the pitot",
    "density_share": "density", "airspeed_share": "scale of the airspeed", "upwash_share": "upwash",
    "alpha_scale": "scale of the alpha vane", "alpha_zero_rad": "zero of the alpha vane",
    "beta_scale": "scale of the beta vane", "beta_zero_rad": "zero of the beta vane",
    "vane_delay_s": "delay of the vanes",
    "beta_delay_difference_s": "delay of the beta vanes behind the alpha vanes",
    "friction_share": "friction of the vanes",
    "imu_delay_s": "delay of the IMU",
    "elevator_scale": "pot of the elevator", "aileron_scale": "pot of the ailerons",
    "rudder_scale": "pot of the rudder",
    "elevator_servo_scale": "servo of the elevator",
    "aileron_servo_scale": "servos of the ailerons",
    "rudder_servo_scale": "servo of the rudder",
    "servo_delay_s": "delay of the servos", "clock_share": "clock",
}  # fmt: skip
_ALONG = {
    "cg_{}_m": "place of the CG along {}", "imu_{}_m": "place of the IMU along {}",
    "vane_{}_m": "place of the vanes along {}", "imu_tilt_{}_rad": "tilt of the IMU about {}",
    "gyro_bias_{}_radps": "zero of the gyro about {}",
    "gyro_scale_{}": "scale of the gyro about {}",
    "accel_bias_{}_mps2": "zero of the accelerometer along {}",
    "accel_scale_{}": "scale of the accelerometer along {}",
}  # fmt: skip
ERROR_LABELS |= {
    name.format(axis): words.format(axis) for name, words in _ALONG.items() for axis in "xyz"
}


def recording_notes(instrument: SensorErrorModel) -> list[str]:
    """Return the notes of a flight on surfaces without a pot and on a clock without GPS.

    Parameters
    ----------
    instrument : SensorErrorModel
        Of that flight: its `recording` says which surfaces were only commanded.

    Returns
    -------
    list of str
        A sentence for each, none where pots and GPS measured.
    """
    hertz, rate = instrument.servo
    whose = "the aircraft file's servos" if instrument.servo_hz > 0.0 else "usual servos"
    lines = []
    if instrument.recording.maker == FOREIGN:
        e = instrument.errors
        vanes, pitot = (100.0 * NORMAL_95 * e[n].of_mean() for n in ("vane_scale", "pitot_scale"))
        zero = math.degrees(NORMAL_95 * e["vane_zero_rad"].of_mean("alpha_a", "alpha_b"))
        lines.append(
            f"sensors of others: vanes may be wrong by {vanes:.0f} % and {zero:.1f} deg, dynamic"
            f" pressure by {pitot:.0f} % (95 %); [error.NAME] of a calibration says better"
        )
    if instrument.recording.commanded:
        lines.append(
            f"{', '.join(instrument.recording.commanded)}: the command through {whose}"
            f" ({hertz:g} Hz, {rate:.3g} rad/s); a pot knows better"
        )
    if instrument.recording.clock_share is None:
        share = 100.0 * NORMAL_95 * clock_share(instrument)
        lines.append(f"no GPS checked the clock: {share:.2g} % of its scale are open (95 %)")
    return lines
