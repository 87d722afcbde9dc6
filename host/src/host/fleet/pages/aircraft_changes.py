"""The test of change over every aircraft of a type."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.fleet.statistics.change_causes import cause_patterns
from host.fleet.statistics.changes import BASELINE, Alarm, ChangeTest
from host.fleet.statistics.loaded_flight import LoadedFlight
from host.fleet.statistics.type_model import TypeModel


@dataclass(frozen=True)
class AircraftHistory:
    """One aircraft over its flights, by date.

    Attributes
    ----------
    aircraft : str
    flights : tuple of LoadedFlight
        Those that tell every derivative of `names`.
    names : tuple of str
    alarms : tuple of Alarm
    """

    aircraft: str
    flights: tuple[LoadedFlight, ...]
    names: tuple[str, ...]
    alarms: tuple[Alarm, ...]

    @property
    def judged(self) -> int:
        """How many flights were held against the first ones."""
        return max(len(self.flights) - BASELINE, 0)


def histories(model: TypeModel) -> list[AircraftHistory]:
    """Return every aircraft of a type, each held against its own first flights."""
    found = []
    for aircraft in model.aircraft:
        own = sorted(
            (f for f in model.flights if f.aircraft == aircraft), key=lambda f: (f.date, f.label)
        )
        names = _told_by_all(own, list(model.effects))
        flights = [f for f in own if all(f.tells(n) for n in names)]
        alarms = _alarms(model, flights, names) if names and len(flights) > BASELINE else []
        found.append(AircraftHistory(aircraft, tuple(flights), names, tuple(alarms)))
    return found


def _told_by_all(flights: Sequence[LoadedFlight], names: Sequence[str]) -> tuple[str, ...]:
    """Return the derivatives that nine of ten flights tell."""
    return tuple(n for n in names if sum(f.tells(n) for f in flights) >= 0.9 * len(flights))


def _alarms(
    model: TypeModel, flights: Sequence[LoadedFlight], names: tuple[str, ...]
) -> list[Alarm]:
    at = flights[0].conditions
    usual = {n: model.effects[n].mean.value for n in names}
    patterns = cause_patterns(names, usual, at["chord_m"] / at["span_m"])
    spread = np.nan_to_num(np.array([model.effects[n].within.value for n in names]))
    if not patterns:
        return []
    each = [_part(f, names) for f in flights]
    test = ChangeTest(patterns, spread)
    return test.alarms([v for v, _ in each], [c for _, c in each])


def _part(flight: LoadedFlight, names: tuple[str, ...]) -> tuple[Array, Array]:
    at = [flight.names.index(n) for n in names]
    own = flight.own[np.ix_(at, at)]
    least = 1e-9 * float(np.max(np.diag(own)))
    return flight.values[at], own + least * np.eye(len(at))


def change_lines(found: Sequence[AircraftHistory]) -> list[str]:
    """Return a line for each aircraft that has changed, and one for what could not be judged."""
    lines = []
    for one in found:
        if one.alarms:
            first, last = one.alarms[0], one.alarms[-1]
            flight = one.flights[first.since]
            others = f", or {' or '.join(last.others)}" if last.others else ""
            lines.append(
                f"changed: {one.aircraft} from flight {first.since + 1}"
                f" ({flight.date or 'undated'}) on: {last.cause}{others}, {100 * last.size:+.1f} %"
                f" ({last.strength:.1f} standard deviations)"
            )
    young = [one.aircraft for one in found if not one.judged]
    if young:
        lines.append(
            f"not yet tested for change ({BASELINE} flights say what an aircraft is):"
            f" {', '.join(young)}"
        )
    return lines or ["no aircraft has changed"]
