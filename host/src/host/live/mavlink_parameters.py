"""The calibration as MAVLink parameters: names of at most 16 characters, read only."""

from __future__ import annotations

from host.physical.calibration import Calibration

LONGEST_NAME = 16
_SHORTER = {
    "channel.": "", "imu_original": "IMUO", "imu.": "IMU_", "pulse.": "PULSE_", ".": "_",
    "aileron": "AIL", "elevator": "ELE", "rudder": "RUD", "throttle": "THR", "right": "R",
    "left": "L",
}  # fmt: skip


def calibration_parameters(calibration: Calibration) -> list[tuple[str, float]]:
    """Return name and value of each zero and slope.

    Parameters
    ----------
    calibration : Calibration

    Returns
    -------
    list of (str, float)
        Such as ``("ALPHA_A_ZERO", 512.0)``, or with the axis, ``("IMU_GYRO_SLOPE2", 1.0)``.
    """
    found = []
    for line, numbers in calibration.lines.items():
        name = line
        for long, short in _SHORTER.items():
            name = name.replace(long, short)
        for kind, values in (("ZERO", numbers.zero), ("SLOPE", numbers.slope)):
            for axis, value in enumerate(values):
                suffix = f"{kind}{axis if len(values) > 1 else ''}"
                room = LONGEST_NAME - len(suffix) - 1
                found.append((f"{name.upper()[:room].rstrip('_')}_{suffix}", float(value)))
    return found
