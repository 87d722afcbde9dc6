"""The test of change over every aircraft of a type."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.fleet.statistics.change_causes import RARE, cause_patterns, size_text
from host.fleet.statistics.changes import BASELINE, Alarm, ChangeTest
from host.fleet.statistics.loaded_flight import LoadedFlight
from host.fleet.statistics.type_model import TypeModel
from host.fleet.statistics.watched_quantities import flight_spread, with_watched

_ESTIMATED_SHARE = 0.75  # of flights: a quantity that fewer estimate is not tested
_MOST_MOVED = 3  # of the quantities that a line names


@dataclass(frozen=True)
class AircraftHistory:
    """One aircraft over its flights, by date.

    Attributes
    ----------
    aircraft : str
    flights : tuple of LoadedFlight
        Flights that have an estimate of every quantity in `names`.
    names : tuple of str
    alarms : tuple of Alarm
    """

    aircraft: str
    flights: tuple[LoadedFlight, ...]
    names: tuple[str, ...]
    alarms: tuple[Alarm, ...]

    @property
    def judged(self) -> int:
        """How many flights were compared with the first ones."""
        return max(len(self.flights) - BASELINE, 0)


def histories(model: TypeModel) -> list[AircraftHistory]:
    """Return every aircraft of a type, each compared with its own first flights."""
    flown = {a: _flown(model, a) for a in model.aircraft}
    first = [f for flights in flown.values() for f in flights[:BASELINE]]
    known = [*model.effects, *dict.fromkeys(n for f in first for n in f.watched)]
    spread = {n: flight_spread(first, n) for n in known}
    found = []
    for aircraft, own in flown.items():
        names = _estimated_by_most(own, known)
        flights = [f for f in own if all(f.has_estimate(n) for n in names)]
        alarms = []
        if names and len(flights) > BASELINE:
            alarms = _alarms(flights, names, spread, list(flown.values()))
        found.append(AircraftHistory(aircraft, tuple(flights), names, tuple(alarms)))
    return found


def _flown(model: TypeModel, aircraft: str) -> list[LoadedFlight]:
    """Return an aircraft's flights by date, each with what is watched."""
    own = (with_watched(f) for f in model.flights if f.aircraft == aircraft)
    return sorted(own, key=lambda f: (f.date, f.label))


def _estimated_by_most(flights: Sequence[LoadedFlight], names: Sequence[str]) -> tuple[str, ...]:
    """Return the quantities that most flights estimate; a finding excludes some in a flight."""
    least = _ESTIMATED_SHARE * len(flights)
    return tuple(n for n in names if sum(f.has_estimate(n) for f in flights) >= least)


def _alarms(
    flights: Sequence[LoadedFlight],
    names: tuple[str, ...],
    spread: Mapping[str, float],
    fleet: Sequence[Sequence[LoadedFlight]],
) -> list[Alarm]:
    at, each = flights[0].conditions, [_part(f, names) for f in flights]
    usual = np.mean([v for v, _ in each[:BASELINE]], axis=0)
    patterns = cause_patterns(
        names, dict(zip(names, usual.tolist(), strict=True)), at["chord_m"] / at["span_m"]
    )
    if not patterns:
        return []
    test = ChangeTest(patterns, np.array([spread[n] for n in names]), RARE)
    test = test.scaled([_first_parts(own, names) for own in fleet])
    return test.alarms([v for v, _ in each], [c for _, c in each])


def _first_parts(
    flights: Sequence[LoadedFlight], names: tuple[str, ...]
) -> tuple[list[Array], list[Array]]:
    """Return the estimates of the first flights of an aircraft that have all these quantities."""
    parts = [_part(f, names) for f in flights[:BASELINE] if all(f.has_estimate(n) for n in names)]
    return [v for v, _ in parts], [c for _, c in parts]


def _part(flight: LoadedFlight, names: tuple[str, ...]) -> tuple[Array, Array]:
    at = [flight.names.index(n) for n in names]
    own = flight.own[np.ix_(at, at)]
    # Quantities have different units, so each is divided by its own deviation.
    return flight.values[at], own + 1e-9 * np.diag(np.maximum(np.diag(own), 1e-12))


def change_lines(found: Sequence[AircraftHistory]) -> list[str]:
    """Return a line for each aircraft that has changed, and one for what could not be judged."""
    lines = [_changed(one) for one in found if one.alarms]
    young = [one.aircraft for one in found if not one.judged]
    if young:
        lines.append(
            f"not yet tested for change ({BASELINE} flights say what an aircraft is):"
            f" {', '.join(young)}"
        )
    return lines or ["no aircraft has changed"]


def _changed(one: AircraftHistory) -> str:
    first, last = one.alarms[0], one.alarms[-1]
    flight = one.flights[first.since]
    others = f", or {' or '.join(last.others)}" if last.others else ""
    moved = ", ".join(one.names[k] for k in last.moved[:_MOST_MOVED])
    return (
        f"changed: {one.aircraft} from flight {first.since + 1} ({flight.date or 'undated'}) on:"
        f" {last.cause}{others}, {size_text(last.cause, last.size)}"
        f" ({last.strength:.1f} standard deviations" + (f"; moved: {moved})" if moved else ")")
    )
