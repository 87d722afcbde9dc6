"""Quantities that are no derivatives, watched for changes: vane zeros, servo throws and lags.

alpha_zero_rad, beta_zero_rad    vane reading at zero normal force, and at zero side force
elevator_slope                   position by the pot over the pulse, rad/us; aileron, rudder
elevator_lag_s                   by which the position is behind the pulse; aileron, rudder
servo_lag_s                      one lag of all servos, estimated in the answer where no pot
measures
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.fleet.statistics.loaded_flight import LoadedFlight, fleet_estimates
from host.fleet.statistics.variance_components import FEWEST_AIRCRAFT, restricted_likelihood

SURFACES = {"elevator": "de", "aileron": "da", "rudder": "dr"}
ZEROS = {"alpha_zero_rad": "alpha", "beta_zero_rad": "beta"}
SLOPE, LAG_S = "_slope", "_lag_s"


def with_watched(flight: LoadedFlight) -> LoadedFlight:
    """Return a flight with its watched quantities behind its derivatives, errors all its own."""
    if not flight.watched:
        return flight
    own, count = np.diag([sd**2 for _, sd in flight.watched.values()]), len(flight.names)
    both = np.zeros((count + len(own), count + len(own)))
    both[:count, :count], both[count:, count:] = flight.own, own
    return replace(
        flight,
        names=(*flight.names, *flight.watched),
        values=np.append(flight.values, [value for value, _ in flight.watched.values()]),
        own=both,
        loadings=np.pad(flight.loadings, ((0, 0), (0, len(own)))),
    )


def flight_spread(flights: Sequence[LoadedFlight], name: str) -> float:
    """Return the standard deviation of a quantity between flights of an aircraft, by restricted
    likelihood; 0 where only one aircraft has it.

    Parameters
    ----------
    flights : sequence of LoadedFlight
        From before any change: an aircraft's first ones.
    name : str
    """
    if len({f.aircraft for f in flights if f.has_estimate(name)}) < FEWEST_AIRCRAFT:
        return 0.0
    return float(np.sqrt(restricted_likelihood(fleet_estimates(flights, name))[1]))
