"""Recorded flights that several tests look at: each is flown and reconstructed once a run."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from host.aircraft.mass_properties import airframe_data
from host.instrument.deviations import sensor_error_model
from host.readers.even_grid import even_columns
from host.sysid.coefficients import Window
from host.sysid.reconstruction import Compatibility, reconstruct
from host.twin.testcard.cards import load
from host.twin.virtual import VirtualFlight, virtual_flight
from studies import wrong_flights

from tests.host.logs import ROOT

NAME = "ultrastick25e"
# Ten test points with a single turn, in light turbulence: turns tell the beta vane's slope and load
# servos, which two tests of an instrument leave out.
STRAIGHT_ON = str(ROOT / "tests" / "data" / "straight_on.toml")
Columns = dict[str, np.ndarray]
linear_flight = lru_cache(maxsize=12)(wrong_flights.fly)  # of a linear aircraft


@lru_cache(maxsize=5)
def flown(card: str, seed: int) -> tuple[VirtualFlight, Columns]:
    """Return a flight and the columns of its log at even instants; nobody writes into them."""
    flight = virtual_flight(card, seed)
    return flight, even_columns(flight.table)[0]


@lru_cache(maxsize=5)
def reconstructed(card: str, seed: int) -> Compatibility:
    """Return what its sensors are wrong by, as it is found."""
    return reconstruct(flown(card, seed)[1], airframe_data(NAME), sensor_error_model(NAME))


@lru_cache(maxsize=1)
def nominal_multisine() -> VirtualFlight:
    """Return a flight with dynamics, friction and noise of the sensors, gusts, nothing drawn."""
    card = load("multisine")
    nominal = replace(card, sensors=replace(card.sensors, tolerances=False))
    return virtual_flight(nominal, 7, chain="none")


def aloft(flight: VirtualFlight) -> tuple[Columns, list[Window]]:
    """Return the even columns of a flight behind its launch, and the windows of its maneuvers."""
    columns, _ = even_columns(flight.table)
    flying = columns["t_s"] > 8.0
    windows = [
        Window(float(str(m["start_s"])) - 0.5, float(str(m["end_s"])), m["axes"] == ["elevator"])
        for m in flight.maneuvers
    ]
    return {k: v[flying] for k, v in columns.items()}, windows
