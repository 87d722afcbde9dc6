"""The calibration file of the virtual instrument: what the host is told, with its uncertainty.

Zeros and slopes are the nominal ones; the flight's own errors (`draws`) are not in it.
"""

from __future__ import annotations

import math
import tomllib

from host.aircraft.file import Aircraft
from host.export.toml import dumps
from host.resources import resource
from host.twin.flight import draws
from host.twin.flight.fly import IDLE_US, NEUTRAL_US, THROW_US
from host.twin.sensors.analog import CHANNELS
from host.twin.testcard.cards import AXES

UNIFORM = 1.0 / math.sqrt(3.0)  # standard deviation of a uniform number over its half-width


def calibration(aircraft: Aircraft) -> str:
    """Return the text of the calibration file that belongs to virtual flights of an aircraft."""
    default = tomllib.loads(resource("default.toml").read_text(encoding="utf-8"))
    source = "virtual instrument, host/twin/flight/draws.py"
    channels: dict[str, object] = {}
    for name in CHANNELS:
        entry = dict(default["channel"][name])
        slope = float(entry["slope"])
        if name.startswith("dp"):
            zero_sigma, slope_sigma = draws.PITOT_DRIFT_COUNT, draws.PITOT_SCALE
        elif name.startswith("pot"):
            zero_sigma, slope_sigma = draws.POT_ZERO_RAD / slope, draws.POT_SCALE
        else:
            zero_sigma, slope_sigma = draws.VANE_ZERO_RAD / slope, draws.VANE_SCALE
        entry["zero_sigma"] = round(float(zero_sigma) * UNIFORM, 4)
        entry["slope_sigma"] = round(slope_sigma * UNIFORM, 4)
        entry["source"] = source
        channels[name] = entry
    pulses: dict[str, object] = {}
    for axis in AXES:
        throttle = axis == "throttle"
        limit = 0.5 if throttle else aircraft.scalar(f"surfaces.{axis}_limit_rad")
        pulses[axis] = {
            "unit": "" if throttle else "rad",
            "zero": IDLE_US if throttle else NEUTRAL_US,
            "slope": limit / THROW_US,
            "zero_sigma": 1.0,
            "slope_sigma": 0.01,
            "source": "virtual transmitter: full throw is +-400 us",
        }
    imu = {
        "gyro": {
            **default["imu"]["gyro"],
            "zero_sigma": round(float(draws.GYRO_BIAS_RADPS) * UNIFORM, 5),
            "slope_sigma": round(draws.GYRO_SCALE * UNIFORM, 5),
            "source": source,
        },
        "accel": {
            **default["imu"]["accel"],
            "zero_sigma": round(draws.ACCEL_BIAS_MPS2 * UNIFORM, 4),
            "slope_sigma": round(draws.ACCEL_SCALE * UNIFORM, 5),
            "source": source,
        },
    }
    return dumps(
        {
            "format": default["format"],
            "version": default["version"],
            "name": f"virtual-{aircraft.name}",
            "date": default["date"],
            "default": False,
            "channel": channels,
            "pulse": pulses,
            "imu": imu,
        }
    )
