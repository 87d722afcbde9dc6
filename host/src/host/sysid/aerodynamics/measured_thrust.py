"""Thrust of a flight: measured, by measured shaft power, or by throttle and the aircraft file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.aircraft.powerplant import Powerplant, without_propeller
from host.arrays import Array
from host.sysid.models.thrust_column import THRUST

# Efficiency of a small fixed-pitch propeller in level flight, where nothing says what its own is:
# wind-tunnel data of such propellers (UIUC propeller data site, volume 1) have 0.5 to 0.7 about
# their best.
EFFICIENCY, EFFICIENCY_SHARE = 0.6, 0.15
LEAST_MPS = 3.0  # below, thrust from power and airspeed is none


@dataclass(frozen=True, slots=True)
class FlightThrust:
    """Thrust along the flight, N, (n,); None where the propeller gives it from the throttle.

    `known` says whether drag can be separated from it; `assumed_share` is the standard deviation
    of one that rests on an assumption.
    """

    thrust_n: Array | None
    known: bool
    remarks: tuple[str, ...] = ()
    assumed_share: float | None = None


def thrust_column(columns: Mapping[str, Array], powerplant: Powerplant) -> FlightThrust:
    """Return the thrust of a flight by the best that is there: measured, by power, by throttle.

    Parameters
    ----------
    columns : mapping of (n,) Array
        SI; `thrust_n`, `power_w` (of the shaft) or `throttle`.
    powerplant : Powerplant
    """
    of_power = "" if powerplant.present else ", along x through the CG"
    if "thrust_n" in columns:
        return FlightThrust(columns["thrust_n"], True, (f"thrust as measured{of_power}",))
    if "power_w" in columns and "airspeed_mps" in columns:
        power, speed = columns["power_w"], columns["airspeed_mps"]
        if powerplant.of_power is not None and "density_kgpm3" in columns:
            thrust = powerplant.of_power(power, speed, columns["density_kgpm3"])
            return FlightThrust(thrust, True, ("thrust by the measured power and the propeller",))
        thrust = EFFICIENCY * power / np.maximum(speed, LEAST_MPS)
        said = (
            f"thrust by the measured power{of_power}: an efficiency of {EFFICIENCY} is assumed, to"
            f" {100.0 * EFFICIENCY_SHARE:.0f} %; [propulsion] of the aircraft file says better"
        )
        return FlightThrust(thrust, True, (said,), EFFICIENCY_SHARE)
    if powerplant.present and "throttle" in columns:
        return FlightThrust(None, True)
    return FlightThrust(np.zeros(len(columns["t_s"])), False)


def with_thrust(columns: Mapping[str, Array], powerplant: Powerplant | None) -> Mapping[str, Array]:
    """Return columns with the thrust that was measured, or follows from measured power, in one.

    Parameters
    ----------
    columns : mapping of (n,) Array
    powerplant : Powerplant or None
        Its propeller makes thrust of power.
    """
    found = thrust_column(columns, powerplant or without_propeller())
    if not found.known or found.thrust_n is None:
        return columns
    return {**columns, THRUST: found.thrust_n}
