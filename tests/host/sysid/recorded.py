"""Recorded flights that several tests look at: each is flown and reconstructed once a run."""

from functools import lru_cache

import numpy as np
from host.aircraft.mass_properties import airframe_data
from host.instrument.deviations import sensor_error_model
from host.readers.even_grid import even_columns
from host.sysid.reconstruction import Compatibility, reconstruct
from host.twin.virtual import VirtualFlight, virtual_flight

from tests.host.logs import ROOT

NAME = "ultrastick25e"
# Ten test points with a single turn, in light turbulence: turns tell the beta vane's slope and load
# servos, which two tests of an instrument leave out.
STRAIGHT_ON = str(ROOT / "tests" / "data" / "straight_on.toml")
Columns = dict[str, np.ndarray]


@lru_cache(maxsize=5)
def flown(card: str, seed: int) -> tuple[VirtualFlight, Columns]:
    """Return a flight and the columns of its log at even instants; nobody writes into them."""
    flight = virtual_flight(card, seed)
    return flight, even_columns(flight.table)[0]


@lru_cache(maxsize=5)
def reconstructed(card: str, seed: int) -> Compatibility:
    """Return what its sensors are wrong by, as it is found."""
    return reconstruct(flown(card, seed)[1], airframe_data(NAME), sensor_error_model(NAME))
