"""Cards designed from the prior model of an aircraft.

Widths come from its modes, amplitudes from flying each input once.
"""

from __future__ import annotations

import math
from dataclasses import astuple, replace

from host.aircraft.file import Aircraft
from host.aircraft.input_steps import ROLL_HALF_S, ROLL_UNIT_S, half_of_doublet_s, unit_of_3211_s
from host.aircraft.linear_aircraft import load
from host.aircraft.linearisation import linearise, modes
from host.aircraft.mode_names import DUTCH_ROLL, SHORT_PERIOD
from host.aircraft.trim import solve
from host.planning.card_planning import exact, point_of
from host.planning.home_turns import with_turns
from host.twin.flight.fly import fly
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import BEFORE_S, Card, Pilot, Segment

# Excursions a first test flight of a trainer keeps to; amplitudes of a designed card aim at them.
TARGET_EXCURSIONS = {"alpha_deg": 3.5, "beta_deg": 6.0, "bank_deg": 30.0}


def _periods_s(aircraft: Aircraft, airspeed_mps: float) -> tuple[float, float]:
    """Return the undamped periods of short period and dutch roll."""
    frame = aircraft.airframe()
    found = {m.name: m for m in modes(linearise(frame, solve(frame, airspeed_mps)))}
    short, dutch = (found[name].frequency_radps for name in (SHORT_PERIOD, DUTCH_ROLL))
    return 2.0 * math.pi / short, 2.0 * math.pi / dutch


def mode_widths_s(aircraft: Aircraft, airspeed_mps: float) -> dict[str, float]:
    """Return the unit of a 3-2-1-1 on each axis: 0.3 periods of the mode that it excites.

    Parameters
    ----------
    aircraft : Aircraft
    airspeed_mps : float
    """
    short, dutch = _periods_s(aircraft, airspeed_mps)
    units = {"elevator": unit_of_3211_s(short), "aileron": ROLL_UNIT_S,
             "rudder": unit_of_3211_s(dutch)}  # fmt: skip
    return {axis: round(unit, 2) for axis, unit in units.items()}


def design(name: str, airspeed_mps: float = 0.0) -> Card:
    """Make a card for an aircraft from its prior model.

    Elevator 3-2-1-1 with a unit of 0.3 and a doublet half of 0.5 short-period periods, rudder
    doublet of half dutch-roll periods, aileron doublet long against the roll mode; amplitudes for
    the excursions of `TARGET_EXCURSIONS`, found by flying each input once and scaling (Jategaonkar,
    Flight Vehicle System Identification, chapter 2). Turns between them keep it near home.

    Parameters
    ----------
    name : str
        Aircraft.
    airspeed_mps : float
        0: the aircraft file's.

    Returns
    -------
    Card

    Raises
    ------
    AircraftError, TrimError
        The aircraft cannot be read, or not be trimmed at that airspeed.
    """
    aircraft = load(name)
    speed = airspeed_mps or aircraft.scalar("trim.airspeed_mps")
    short, dutch = _periods_s(aircraft, speed)
    draft = (
        Segment("3211", axes=("elevator",), amplitudes=(2.0,), width_s=unit_of_3211_s(short)),
        Segment("doublet", axes=("elevator",), amplitudes=(2.0,), width_s=half_of_doublet_s(short)),
        Segment("doublet", axes=("rudder",), amplitudes=(4.0,), width_s=half_of_doublet_s(dutch)),
        Segment("doublet", axes=("aileron",), amplitudes=(3.0,), width_s=ROLL_HALF_S),
    )
    flight = Card(name="plan", title="", aircraft=name, segments=draft)
    flight = replace(flight, flight=replace(flight.flight, airspeed_mps=speed))
    record = fly(exact(flight))
    data = air_data(record)
    segments: list[Segment] = [Segment("trim", duration_s=5.0)]
    for s, w in zip(draft, record.schedule.windows, strict=True):
        p = point_of(record, data, s, w)
        excursion = {
            "elevator": (p.alpha_deg, TARGET_EXCURSIONS["alpha_deg"]),
            "rudder": (p.beta_deg, TARGET_EXCURSIONS["beta_deg"]),
            "aileron": (p.bank_deg, TARGET_EXCURSIONS["bank_deg"]),
        }[s.axes[0]]
        limit = math.degrees(aircraft.scalar(f"surfaces.{s.axes[0]}_limit_rad"))
        amplitude = min(s.amplitudes[0] * excursion[1] / excursion[0], 0.5 * limit)
        chosen = replace(
            s, amplitudes=(round(amplitude * 2.0) / 2.0 or 0.5,), width_s=round(s.width_s, 2)
        )
        segments += [chosen] * 3
    segments.append(Segment("trim", duration_s=5.0))
    about = "" if aircraft.straight else f" at {speed:.0f} m/s"
    title = f"{aircraft.title}{about}: three of each input"
    return with_turns(replace(flight, title=title, segments=tuple(segments)))


def document(card: Card) -> dict[str, object]:
    """Return a designed card as `host.export.toml.dumps` takes it.

    Parameters
    ----------
    card : Card

    Returns
    -------
    dict
        Equal test points one after the other are one segment with its ``repeat``.
    """
    listed: list[dict[str, object]] = []
    for s in card.segments:
        row: dict[str, object] = {"kind": s.kind}
        if s.axes:
            row["axis"] = list(s.axes)
            row["amplitude"] = list(s.amplitudes)
        for key in ("duration_s", "bank_deg", "width_s", "low_hz", "high_hz", "airspeed_mps"):
            value = getattr(s, key)
            if value:
                row[key] = value
        if s.before_s != BEFORE_S:
            row["before_s"] = s.before_s
        if s.attention >= 0.0:
            row["attention"] = s.attention
        if s.tones:
            row["tones"] = [list(astuple(tone)) for tone in s.tones]
        if listed and {k: v for k, v in listed[-1].items() if k != "repeat"} == row:
            listed[-1]["repeat"] = int(str(listed[-1].get("repeat", 1))) + 1
        else:
            listed.append(row)
    document: dict[str, object] = {
        "format": 1,
        "title": card.title,
        "aircraft": card.aircraft,
        "flight": {"airspeed_mps": card.flight.airspeed_mps},
    }
    if card.pilot.hands_off_s != Pilot().hands_off_s:
        document["pilot"] = {"hands_off_s": card.pilot.hands_off_s}
    return document | {"segment": listed}
