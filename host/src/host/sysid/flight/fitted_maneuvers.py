"""Which maneuvers a linear model is fitted to, and which of them are held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.checks.small_inputs import free_motion
from host.sysid.flight.flown_maneuver import FlownManeuver, flown_maneuvers
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
from host.sysid.maneuvers.maneuver_grade import grade
from host.sysid.maneuvers.maneuver_selection import HELD_OUT_FROM, SURFACES, joined_windows

WEAK_GRADE = 0.2
# Over within 3 s of an input: what follows is the slow motion that these models leave out.
QUICK = ("short-period", "roll")


class NoManeuverError(IdentificationError):
    """Error: no maneuver that a model could be fitted to."""


def fitted_and_held_out(
    flights: Sequence[ReconstructedFlight], axes: Sequence[str], template: str, *, named: bool,
    free: bool = False,
) -> tuple[list[FlownManeuver], list[FlownManeuver]]:  # fmt: skip
    """Return the maneuvers to fit and those to hold out.

    Parameters
    ----------
    flights : sequence of ReconstructedFlight
    axes : sequence of str
        Surfaces whose maneuvers a model is fitted to.
    template : str
        What the model is called in messages.
    named : bool
        A stretch that was given is one of them, whatever moved more.

    Raises
    ------
    NoManeuverError
        If there is none.
    """
    if free:
        flights = [f if f.maneuvers else _in_free_motion(f) for f in flights]
    own = [_of_axes(flight.maneuvers, axes, template, named=named) for flight in flights]
    mine = flown_maneuvers(flights, joined_windows(own))
    if not mine:
        raise NoManeuverError(_nothing_moved(flights) or _other_moved(flights, axes, template))
    # The order in which flights are given shall not choose the maneuver that is held out.
    mine.sort(key=lambda m: [(f.start_s, f.end_s, f.amplitude) for f in m.flight.maneuvers])
    return _apart([m for m in mine if _worth_it(m)] or mine)


def _apart(good: list[FlownManeuver]) -> tuple[list[FlownManeuver], list[FlownManeuver]]:
    """Return those to fit, and those held out with their responses; what was given is fitted."""
    held = _held_out([m for m in good if not m.found.given])
    return [m for m in good if m not in held], [replace(m, found=m.found.response()) for m in held]


def _in_free_motion(flight: ReconstructedFlight) -> ReconstructedFlight:
    return replace(flight, maneuvers=tuple(free_motion(flight.corrected)))


def _of_axes(
    found: Sequence[DetectedManeuver], axes: Sequence[str], template: str, *, named: bool
) -> list[DetectedManeuver]:
    """Return the maneuvers of some surfaces, and given ones of a model that the user names."""
    own = [f for f in found if f.axis in axes or (f.given and named)]
    return [replace(f, free_end_s=-np.inf) for f in own] if template in QUICK else own


def _worth_it(maneuver: FlownManeuver) -> bool:
    """Return whether a maneuver was given, or promises more than noise."""
    found = maneuver.found
    return found.given or grade(maneuver.flight.corrected, found).score >= WEAK_GRADE


def _other_moved(flights: Sequence[ReconstructedFlight], axes: Sequence[str], template: str) -> str:
    """Return which maneuvers flights have in place of those of a model."""
    every = [f for flight in flights for f in flight.maneuvers]
    given = "; argument models names it all the same" if every[0].given else ""
    others = ", ".join(sorted({f.axis for f in every}))
    return f"no maneuver of {', '.join(axes)} for {template}; found only {others}{given}"


def _nothing_moved(flights: Sequence[ReconstructedFlight]) -> str:
    """Return why flights have no maneuver at all, and what to do; empty where they have one."""
    if any(flight.maneuvers for flight in flights):
        return ""
    if not any(axis in one.recorded for one in flights for axis in SURFACES):
        return (
            f"no column of a surface ({', '.join(SURFACES)}); name one in a map (argument mapping),"
            " or give a stretch (argument from_s, argument to_s)"
        )
    return (
        "no maneuver found: no surface moved by more than 1.4 degrees at once; give argument from_s"
        " and argument to_s, or fly a doublet or 3-2-1-1 of 3 degrees or more"
    )


def columns_of(used: Sequence[FlownManeuver]) -> dict[str, Array]:
    """Return the corrected columns within the maneuvers, every sample once."""
    kept: dict[str, list[Array]] = {}
    flights = list({id(m.flight): m.flight for m in used}.values())
    for flight in flights:
        t = flight.corrected["t_s"]
        cut = np.zeros(len(t), dtype=bool)
        for m in used:
            if m.flight is flight:
                cut |= (t >= m.found.start_s) & (t <= m.found.end_s)
        for name, values in flight.corrected.items():
            if name != "t_s":
                kept.setdefault(name, []).append(values[cut])
    return {k: np.concatenate(v) for k, v in kept.items() if len(v) == len(flights)}


def _held_out(found: list[FlownManeuver]) -> list[FlownManeuver]:
    """Hold out the last maneuver of every axis that was flown at least three times."""
    held = []
    for axis in dict.fromkeys(m.found.axis for m in found):
        mine = [m for m in found if m.found.axis == axis]
        if len(mine) >= HELD_OUT_FROM:
            held.append(mine[-1])
    return held
