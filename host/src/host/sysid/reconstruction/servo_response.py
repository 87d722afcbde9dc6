"""Surfaces behind their servos, where the columns have the commands.

A servo follows its pulse as a first order of limited rate (EQUATIONS.md, eq. 15). On a virtual
flight of the card `demo` commands are 22 ms ahead of the surfaces; through the servos of the
aircraft file 1 to 3 ms are left, the age of a pulse in its row.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.instrument.deviations import SensorErrorModel


def commands_of(columns: Mapping[str, Array], instrument: SensorErrorModel) -> dict[str, Array]:
    """Return the columns that are commands: of surfaces that no pot measured."""
    names = (f"{surface}_rad" for surface in instrument.recording.commanded)
    return {name: columns[name] for name in names if name in columns}


def surface_positions(
    columns: Mapping[str, Array], instrument: SensorErrorModel
) -> dict[str, Array]:
    """Return columns with commanded surfaces where their servos had brought them.

    Parameters
    ----------
    columns : mapping of (n,) arrays
        SI, on an even grid.
    instrument : SensorErrorModel
        Says which surfaces are commanded, and how fast servos are.
    """
    commands = commands_of(columns, instrument)
    return {**columns, **behind_servos(commands, columns["t_s"], (0.0, *instrument.servo))}


def behind_servos(
    commands: Mapping[str, Array], t_s: Array, servo: tuple[float, float, float]
) -> dict[str, Array]:
    """Return commanded surfaces behind servos of a delay (s), bandwidth (Hz) and rate limit (rad/s)
    on an even grid."""
    delay_s, bandwidth_hz, rate_radps = servo
    dt_s = float(t_s[1] - t_s[0])
    at = {
        name: servo_response(values, dt_s, bandwidth_hz, rate_radps)
        for name, values in commands.items()
    }
    return {name: np.interp(t_s - delay_s, t_s, x) if delay_s else x for name, x in at.items()}


def servo_response(
    command_rad: Array, dt_s: float, bandwidth_hz: float, rate_radps: float
) -> Array:
    """Return the response of a servo to a command that is held from row to row, (n,), rad.

    Exact between rows: as fast as it can until the rest decays.
    """
    omega = 2.0 * math.pi * bandwidth_hz
    far = rate_radps / omega if rate_radps > 0.0 else math.inf
    decay = math.exp(-omega * dt_s)
    result = np.empty(len(command_rad))
    at = float(command_rad[0])
    for k, target in enumerate(command_rad.tolist()):
        result[k] = at
        rest = target - at
        if abs(rest) <= far:
            at = target - rest * decay
            continue
        running_s = min((abs(rest) - far) / rate_radps, dt_s)
        rest -= math.copysign(rate_radps * running_s, rest)
        at = target - rest * math.exp(-omega * (dt_s - running_s))
    return result
