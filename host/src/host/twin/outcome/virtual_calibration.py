"""The calibration file of the virtual instrument: what the host reads, with its uncertainty.

Zeros and slopes are the nominal ones; the flight's own errors (`draws`) are not in it.
"""

from __future__ import annotations

import tomllib

from host.aircraft.file import Aircraft
from host.export.toml import dumps
from host.instrument.instrument_errors import (
    IMU_LINES,
    LINES,
    PULSES,
    InstrumentErrors,
    NamedError,
    instrument_errors,
    standard_errors,
)
from host.resources import resource
from host.twin.flight.stick_commands import IDLE_US, NEUTRAL_US, THROW_US
from host.twin.sensors.analog import CHANNELS
from host.twin.testcard.cards import AXES

OF_LINES = {
    name for pair in (*LINES.values(), *PULSES.values(), *IMU_LINES.values()) for name in pair
}


def calibration(aircraft: Aircraft, errors: InstrumentErrors | None = None) -> str:
    """Return the text of the calibration file that belongs to virtual flights of an aircraft.

    Parameters
    ----------
    aircraft : Aircraft
    errors : InstrumentErrors, optional
        Errors to state in the file; the standard ones by default.
    """
    errors = errors or instrument_errors(aircraft)
    default = tomllib.loads(resource("default.toml").read_text(encoding="utf-8"))
    source = "virtual instrument, host/instrument/standard.toml"
    channels: dict[str, object] = {}
    for name in CHANNELS:
        entry = dict(default["channel"][name])
        zero, scale = LINES[name]
        entry["zero_sigma"] = float(f"{errors[zero].sigma(name) / abs(float(entry['slope'])):.4g}")
        entry["slope_sigma"] = float(f"{errors[scale].sigma(name):.4g}")
        entry["source"] = source
        channels[name] = entry
    pulses: dict[str, dict[str, object]] = {}
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
        if not throttle:
            zero, scale = PULSES[f"pulse.{axis}"]
            pulses[axis]["zero_sigma"] = float(f"{errors[zero].sigma(axis) / limit * THROW_US:.4g}")
            pulses[axis]["slope_sigma"] = float(f"{errors[scale].sigma(axis):.4g}")
    imu = {}
    for name, (zero, scale) in IMU_LINES.items():
        sensor = name.partition(".")[2]
        imu[sensor] = {
            **default["imu"][sensor],
            "zero_sigma": float(f"{errors[zero].of_mean('x'):.4g}"),
            "slope_sigma": float(f"{errors[scale].of_mean('x'):.4g}"),
            "source": source,
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
            "error": {e.name: _table(e) for e in errors if _is_stated(e)},
        }
    )


def _is_stated(error: NamedError) -> bool:
    """Return whether an error needs a table: no line and no aircraft file states all of it."""
    if error.aircraft_file:
        return False
    usual = standard_errors()[error.name]
    same = [(e.distribution, e.drawn, e.shared) for e in (error, usual)]
    return same[0] != same[1] or error.name not in OF_LINES


def _table(error: NamedError) -> dict[str, object]:
    """Return a table [error.NAME], without the size where lines state it."""
    table: dict[str, object] = {
        "distribution": error.distribution,
        "drawn": error.drawn,
        "shared": list(error.shared),
        "source": error.source,
    }
    if error.name in OF_LINES:
        return table
    key = "half_width" if error.distribution == "even" else "sigma"
    return {key: list(error.width), **table}
