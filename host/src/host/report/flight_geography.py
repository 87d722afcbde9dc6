"""A flight as places with times: tracks between gaps, test points, events."""

from __future__ import annotations

import itertools

import numpy as np

from host.arrays import Array
from host.errors import UsageError
from host.export.kml_writer import Geography, Path3d, Place
from host.report.shown_flight import GAP_STEPS, ShownFlight

NO_DATE_S = 946_684_800.0  # 2000-01-01: where no GPS gave a date
# aabbggrr, the colours of the page's track
_COLOURS = ("ff0c41c2", "ffad5c0b", "ff3d8015", "ffce227e", "ff3c12be", "ff90740e", "ff0762a1")
_LONGEST_GAP_S = 2.0


def flight_geography(flight: ShownFlight) -> Geography:
    """Return the places of a flight.

    Raises
    ------
    UsageError
        If it has no position.
    """
    if not flight.position:
        raise UsageError(f"{flight.name}: no GPS fix in it, so no track; host plot shows the rest")
    places = _places(flight)
    t_s = flight.position["t_s"]
    said = f"{flight.summary['duration_s']:.1f} s, {flight.summary['complete']}"
    own = flight.summary.get("calibration") or {}
    data = {"calibration": f"{own.get('name', 'none')} {own.get('date', '')}".strip()}
    names = {s["aircraft"] for s in flight.summary.get("sessions", ()) if s.get("aircraft")}
    if names:
        data["aircraft"] = ", ".join(sorted(names))
    data["losses"] = f"{len(flight.summary['losses']['ranges'])} ranges"
    if flight.utc_s is None:
        data["date"] = "unknown: 2000-01-01 stands for the flight's beginning"
    return Geography(
        name=flight.name,
        text=said,
        tracks=[Path3d("track", part) for part in _parts(t_s, places)],
        pieces=_test_points(flight, t_s, places),
        marks=[
            (f"{one.t_s:.2f} s: {one.text}", places[k])
            for one in flight.events
            if (k := _nearest(t_s, one.t_s)) is not None
        ],
        data=data,
    )


def _places(flight: ShownFlight) -> list[Place]:
    own = flight.position
    start = NO_DATE_S if flight.utc_s is None else flight.utc_s
    rows = zip(own["t_s"] + start, own["latitude_deg"], own["longitude_deg"], own["height_m"],
               strict=True)  # fmt: skip
    return [Place(float(t), float(a), float(b), float(h)) for t, a, b, h in rows]


def _parts(t_s: Array, places: list[Place]) -> list[list[Place]]:
    steps = np.diff(t_s)
    longest = max(_LONGEST_GAP_S, 2.0 * GAP_STEPS * float(np.median(steps))) if len(steps) else 0.0
    cuts = [0, *(np.flatnonzero(steps > longest) + 1).tolist(), len(places)]
    return [places[a:b] for a, b in itertools.pairwise(cuts)]


def _test_points(flight: ShownFlight, t_s: Array, places: list[Place]) -> list[Path3d]:
    found = []
    for number, (item, mark) in enumerate(flight.maneuvers, start=1):
        first, last = np.searchsorted(t_s, (item.start_s, item.end_s))
        if last - first > 1:
            name = f"{number}: {item.axis.split('_')[0]} {item.kind}"
            colour = _COLOURS[(number - 1) % len(_COLOURS)]
            text = "; ".join([f"grade {mark.score:.2f}", *mark.remarks])
            found.append(Path3d(name, places[first:last], colour, text))
    return found


def _nearest(t_s: Array, at_s: float) -> int | None:
    """Return the fix nearest to an instant, None where none is within two seconds."""
    k = int(np.argmin(np.abs(t_s - at_s)))
    return k if abs(float(t_s[k]) - at_s) <= _LONGEST_GAP_S else None
