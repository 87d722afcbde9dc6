"""Prior of the servos: delay, bandwidth and rate limit.

A commanded column leads its surface by all three. Means and deviations come from the aircraft file
and the instrument's errors, for a table of others from `foreign.toml`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from host.instrument.deviations import SensorErrorModel, imu_delay_s

# Relative standard deviation of the rate limit: from the aircraft file, and for usual servos,
# whose data sheets give 0.10 to 0.23 s for 60 deg.
KNOWN_RATE_SHARE, USUAL_RATE_SHARE = 0.10, 0.25


@dataclass(frozen=True, slots=True)
class ServoPrior:
    """Means and standard deviations of the three numbers that make a surface lag its command.

    Attributes
    ----------
    mean, sd : tuple of float
        Delay (s), bandwidth (Hz), rate limit (rad/s).
    """

    mean: tuple[float, float, float]
    sd: tuple[float, float, float]


def servo_prior(instrument: SensorErrorModel) -> ServoPrior:
    """Return the prior of the servos of the surfaces that were only commanded.

    The delay is that behind the IMU's stamps: what a fit sees of both is one.
    """
    hertz, rate = instrument.servo
    known = instrument.servo_hz > 0.0
    e, commanded = instrument.errors, instrument.recording.commanded
    share = "servo_bandwidth_share" if known else "servo_unknown_share"
    return ServoPrior(
        (0.0, hertz, rate),
        (
            math.hypot(
                max(e["servo_delay_s"].sigma(s) for s in commanded), imu_delay_s(instrument)
            ),
            hertz * max(e[share].sigma(s) for s in commanded),
            rate * (KNOWN_RATE_SHARE if known else USUAL_RATE_SHARE),
        ),
    )
