"""Channels of an autopilot's log under our names: signals, which surfaces are shares, remarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array
from host.readers.autopilot_log import AutopilotLog, Messages, SensorChoiceError
from host.readers.signals import Signal

STANDARD_DENSITY_KGPM3 = 1.225  # ICAO, sea level: the density for which indicated airspeed is true
STANDARD_TEMPERATURE_DEGC = 15.0
SERVO_HZ = 50.0  # pulses of analogue servos; ArduPilot's default of SERVO_RATE
# Limits that no aircraft of this size exceeds; a value beyond comes from a changed bit.
RANGES = {
    "p_radps": 40.0, "q_radps": 40.0, "r_radps": 40.0,
    "ax_mps2": 320.0, "ay_mps2": 320.0, "az_mps2": 320.0,
    "phi_rad": 7.0, "theta_rad": 1.6, "psi_rad": 7.0, "airspeed_mps": 150.0,
    "qbar_pa": 2e4, "static_pa": 1.2e5, "altitude_m": 1e5, "density_kgpm3": 2.0,
    "v_north_mps": 300.0, "v_east_mps": 300.0, "v_down_mps": 100.0,
    "elevator": 2.0, "aileron": 2.0, "rudder": 2.0, "throttle": 2.0,
}  # fmt: skip

POSITIVE = ("static_pa", "density_kgpm3")


@dataclass(slots=True)
class Channels:
    """Channels of one log.

    Attributes
    ----------
    signals : dict of str to Signal
        By our name with unit; surfaces without ``_rad``: they are shares of full travel.
    notes : list of str
        Lines on chosen sensors and on outputs that became surfaces.
    unknown_outputs : str
        What the log says of outputs that move no surface, where none moves one; empty else.
    clipped : dict of str to int
        Samples of a surface or an IMU at the end of its range.
    output_period_s : float
        Period of the pulses that servos get.
    vibration_mps2 : float
        As the autopilot measured it; NaN if it did not.
    """

    signals: dict[str, Signal] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    unknown_outputs: str = ""
    clipped: dict[str, int] = field(default_factory=dict)
    output_period_s: float = 1.0 / SERVO_HZ
    vibration_mps2: float = float("nan")

    def true_over_indicated(self, t_s: Array) -> Array:
        """Return true over indicated airspeed at instants; one, and a note, without a density."""
        density = self.signals.get("density_kgpm3")
        if density is None:
            self.notes.append("no barometer: airspeed is that of standard density")
            return np.ones(len(t_s))
        seen = np.isfinite(density.values)
        here = np.interp(t_s, density.t_s[seen], density.values[seen])
        return np.asarray(np.sqrt(STANDARD_DENSITY_KGPM3 / here))

    def add(self, name: str, t_s: Array, values: Array, source: str, late_s: float = 0.0) -> None:
        """Add a channel; impossible values count as missing, with a remark."""
        # What the log has in single precision stays so: of a gigabyte twice is too much.
        clean = values if values.dtype == np.float32 else numbers(values)
        limit = RANGES.get(name, np.inf)
        wild = (clean > limit) | (clean < (0.0 if name in POSITIVE else -limit))
        if wild.any():
            clean = clean.copy()
            clean[wild] = np.nan
            self.notes.append(
                f"{name}: {int(wild.sum())} values that no aircraft has count as missing"
            )
        found = Signal(np.asarray(t_s, dtype=np.float64), clean, source, late_s)
        if found.has_values:
            self.signals[name] = found


def numbers(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return values as float64; what a changed bit made of a number is no warning."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(values, dtype=np.float64)


def instance_of(
    log: AutopilotLog, name: str, chosen: Mapping[str, int], notes: list[str]
) -> tuple[Messages, str] | None:
    """Return the messages of the instance asked for, else of the one with most, and its label.

    Raises
    ------
    SensorChoiceError
        If the log does not have the one asked for.
    """
    every = log.messages.get(name)
    asked = chosen.get(name)
    if asked is not None and (not every or asked not in every):
        there = ", ".join(map(str, sorted(every))) if every else "none"
        raise SensorChoiceError(f"{log.path}: no {name} {asked}; the log has {there}")
    if not every:
        return None
    best = asked if asked is not None else min(every, key=lambda k: (-len(every[k]), k))
    if len(every) > 1:
        others = ", ".join(f"--sensor {name}={k}" for k in sorted(every) if k != best)
        notes.append(f"{name} {best} of {len(every)} is used (others: {others})")
    return every[best], f"{name}[{best}]"
