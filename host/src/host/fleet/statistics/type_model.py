"""The model of a type from its flights: every derivative with its spreads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.fleet.statistics.loaded_flight import LoadedFlight, fleet_estimates
from host.fleet.statistics.reference_cg import Place
from host.fleet.statistics.spread_intervals import TypeEffect, type_effect
from host.fleet.statistics.variance_components import FEWEST_AIRCRAFT, FleetEstimates

DIFFERS = 0.05  # probability below which aircraft are said to differ


@dataclass(frozen=True)
class TypeModel:
    """The model of a type.

    Attributes
    ----------
    name : str
    effects : dict of str to TypeEffect
        By derivative.
    estimates : dict of str to FleetEstimates
        Estimates of every flight from which each effect was computed.
    flights : tuple of LoadedFlight
        About the reference CG.
    single_aircraft : tuple of str
        Derivatives that only one aircraft has estimates of.
    cg_m : tuple of float, optional
        Reference point of the moments.
    """

    name: str
    effects: dict[str, TypeEffect]
    estimates: dict[str, FleetEstimates]
    flights: tuple[LoadedFlight, ...]
    single_aircraft: tuple[str, ...]
    cg_m: Place | None = None

    @property
    def aircraft(self) -> list[str]:
        """Names of the aircraft, sorted."""
        return sorted({flight.aircraft for flight in self.flights})

    def alpha_rad(self) -> float:
        """Return the median angle of attack of the flights, rad."""
        return float(np.median(self.conditions("alpha_rad")))

    def conditions(self, name: str) -> list[float]:
        """Return a condition of every flight."""
        return [f.conditions[name] for f in self.flights]

    def differing(self) -> list[str]:
        """Return the derivatives that differ between aircraft, the surest first."""
        found = {n: e.differs for n, e in self.effects.items() if e.differs < DIFFERS}
        return sorted(found, key=found.__getitem__)


def type_model(name: str, flights: Sequence[LoadedFlight], cg_m: Place | None = None) -> TypeModel:
    """Return the model of a type from flights about one CG.

    Parameters
    ----------
    name : str
    flights : sequence of LoadedFlight
    cg_m : tuple of float, optional
        That CG.
    """
    names = list(dict.fromkeys(n for flight in flights for n in flight.names))
    effects, estimates, single_aircraft = {}, {}, []
    for derivative in names:
        aircraft_ids = {f.aircraft for f in flights if f.has_estimate(derivative)}
        if len(aircraft_ids) < FEWEST_AIRCRAFT:
            single_aircraft += [derivative] if aircraft_ids else []
            continue
        estimates[derivative] = fleet_estimates(flights, derivative)
        effects[derivative] = type_effect(estimates[derivative])
    return TypeModel(name, effects, estimates, tuple(flights), tuple(single_aircraft), cg_m)
