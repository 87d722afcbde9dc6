"""Flight cards: what is flown, by whom, in which air, with which faults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from host.aircraft.air import Air
from host.aircraft.airframe import Array
from host.errors import UsageError
from host.files import toml_reader
from host.twin.faults import FAULTS, Fault
from host.twin.testcard.card_ranges import LONGEST_FLIGHT_S, RANGES
from host.twin.testcard.input_shapes import (
    KINDS,
    STEPS,
    harmonics,
)

FOLDER = Path(__file__).parent / "cards"
MOST_SEGMENTS = 2000  # repeated ones counted each
MOST_TONES = 1000  # of a multisine; the widest card has 60
AXES = ("elevator", "aileron", "rudder", "throttle")
BEFORE_S = 3.0  # of trim, as a pilot needs it


class CardError(UsageError):
    """A flight card that cannot be flown: what was found, what was expected."""


@dataclass(frozen=True, slots=True)
class Flight:
    """Where and how the flight starts."""

    airspeed_mps: float = 0.0  # 0: the aircraft file's
    height_m: float = 100.0
    climb_m: float = 0.0  # to that height from the launch; 0: it is cut out
    rate_hz: float = 100.0
    ground_s: float = 5.0  # at rest before the launch, for the zero of the pitot
    heading_deg: float = 0.0
    field_pressure_pa: float = 101325.0
    field_temperature_degc: float = 15.0
    latitude_deg: float = 30.0  # the thesis flew near Cairo
    longitude_deg: float = 31.0


@dataclass(frozen=True, slots=True)
class Pilot:
    """A person with a transmitter; 0 for a machine."""

    timing_s: float = 0.03  # standard deviation of each edge
    amplitude: float = 0.08  # relative standard deviation of each level
    drift: float = 0.05  # of the level, per second of holding it
    hand_s: float = 0.08  # duration of a stick edge
    remnant: float = 0.002  # rms of the stick's wander, of full throw
    delay_s: float = 0.25  # from seeing to moving
    gain: float = 1.0  # of the corrections, 1: crossover at 1.2 rad/s
    early: float = 0.1  # share of maneuvers corrected before they end
    hands_off_s: float = 2.5  # time after the last input before the pilot corrects again
    breaks_off: float = 0.0  # share of step inputs let go before their end, and corrected at once


@dataclass(frozen=True, slots=True)
class Sensors:
    """One switch per error; false makes that part of the chain ideal."""

    tolerances: bool = True  # false: every draw is nominal; the next eleven switch one group each
    imu_bias: bool = True
    imu_scale: bool = True
    imu_misalignment: bool = True
    vane_scale: bool = True  # and zero
    pitot_scale: bool = True
    potentiometers: bool = True
    upwash_tolerance: bool = True
    delay_tolerance: bool = True
    place_tolerance: bool = True  # of CG and sensors
    mass_tolerance: bool = True  # and inertia
    barometer_offset: bool = True
    # Errors that no calibration measures; off by default, so that older cards fly unchanged.
    friction_tolerance: bool = False
    thrust_tolerance: bool = False
    servo_tolerance: bool = False
    noise: bool = True
    imu_filter: bool = True
    vane_dynamics: bool = True
    vane_friction: bool = True
    position: bool = True  # lever arms, local flow and upwash
    quantisation: bool = True
    pitot_drift: bool = True
    attitude_filter: bool = True  # false: true angles
    gps_latency: bool = True
    receiver_jitter: bool = True
    clock_error: bool = True


@dataclass(frozen=True, slots=True)
class Tone:
    """One sine of a multisine: harmonic of 1/duration, share of the amplitude, phase in turns."""

    axis: str
    harmonic: int
    share: float
    phase_turn: float


@dataclass(frozen=True, slots=True)
class Segment:
    """One line of the card; angles in degrees, throttle as a share. A multisine without `tones`
    deals the harmonics of its band out to its axes."""

    kind: str
    duration_s: float = 0.0
    bank_deg: float = 0.0
    axes: tuple[str, ...] = ()
    amplitudes: tuple[float, ...] = ()
    width_s: float = 0.0
    low_hz: float = 0.0
    high_hz: float = 0.0
    before_s: float = BEFORE_S
    airspeed_mps: float = 0.0
    attention: float = -1.0  # of the pilot during the input; -1: 0 for steps, 0.25 for long inputs
    tones: tuple[Tone, ...] = ()

    def tones_of(self, axis: str) -> Array:
        """Return the tones of one axis (k, 3), as `tone_signal` takes them."""
        own = [(t.harmonic, t.share, t.phase_turn) for t in self.tones if t.axis == axis]
        return np.array(own, dtype=np.float64).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class Card:
    """A flight card.

    Attributes
    ----------
    name, title, aircraft : str
    logger : str
        ``recorder`` or ``thesis``: whose rate and rows the card speaks of.
    flight, air, pilot, sensors : dataclasses
    segments : tuple of Segment
    faults : tuple of Fault
    """

    name: str
    title: str
    aircraft: str
    segments: tuple[Segment, ...]
    flight: Flight = field(default_factory=Flight)
    air: Air = field(default_factory=Air)
    pilot: Pilot = field(default_factory=Pilot)
    sensors: Sensors = field(default_factory=Sensors)
    faults: tuple[Fault, ...] = ()


Section = TypeVar("Section", Flight, Air, Pilot, Sensors)


def names() -> list[str]:
    """Return the names of the cards that come with the package, sorted."""
    return toml_reader.names(FOLDER)


def load(source: str | Path) -> Card:
    """Load a flight card.

    Parameters
    ----------
    source : str or Path
        Name of a packaged card, or path of a file.

    Returns
    -------
    Card

    Raises
    ------
    CardError
        What was found and what was expected, in one line.
    """
    document = toml_reader.read(source, FOLDER, "flight card", CardError)
    return parse(document, Path(source).stem)


def parse(document: Mapping[str, object], name: str) -> Card:
    """Make a card of a parsed document; raises CardError."""
    toml_reader.check_format(document, name, CardError)
    known = {"format", "title", "aircraft", "flight", "air", "pilot", "sensors", "segment", "fault"}
    for key in document:
        if key not in known:
            raise CardError(
                f"{name}: unknown key {key!r}, expected one of {', '.join(sorted(known))}"
            )
    aircraft = document.get("aircraft")
    if not isinstance(aircraft, str):
        raise CardError(f"{name}: aircraft is {aircraft!r}, expected a name")
    listed = document.get("segment")
    if not isinstance(listed, list) or not listed:
        raise CardError(f"{name}: no [[segment]], expected at least one")
    faults = document.get("fault", [])
    if not isinstance(faults, list):
        raise CardError(f"{name}: fault is not a list of tables")
    flight = _section(name, document, "flight", Flight)
    segments: list[Segment] = []
    for i, table in enumerate(listed):
        segments += _segments(f"{name}: segment {i + 1}", table)
        if len(segments) > MOST_SEGMENTS:
            raise CardError(f"{name}: more than {MOST_SEGMENTS} segments, repeated ones counted")
    card = Card(
        name=name,
        title=str(document.get("title", name)),
        aircraft=aircraft,
        segments=tuple(segments),
        flight=flight,
        air=_section(name, document, "air", Air),
        pilot=_section(name, document, "pilot", Pilot),
        sensors=_section(name, document, "sensors", Sensors),
        faults=tuple(_fault(f"{name}: fault {i + 1}", table) for i, table in enumerate(faults)),
    )
    if duration_s(card) > LONGEST_FLIGHT_S:
        raise CardError(
            f"{name}: {duration_s(card):g} s in all, expected up to {LONGEST_FLIGHT_S:g} s"
        )
    return card


def duration_s(card: Card) -> float:
    """Return the length of the card, ground time included."""
    return card.flight.ground_s + sum(length_s(card, s) for s in card.segments)


def length_s(card: Card, s: Segment) -> float:
    """Return the length of a segment with the trim before its input and the hands-off time."""
    if s.kind in ("trim", "turn"):
        return s.duration_s
    return s.before_s + input_s(s) + card.pilot.hands_off_s


def turns_home(s: Segment) -> bool:
    """Return whether a segment is a turn until home is ahead: one without a bank of its own."""
    return s.kind == "turn" and s.bank_deg == 0.0


def input_s(s: Segment) -> float:
    """Return the length of an input itself."""
    return sum(length for _, length in STEPS.get(s.kind, ())) * s.width_s or s.duration_s


def _table(where: str, value: object) -> dict[str, object]:
    if not isinstance(value, dict):
        raise CardError(f"{where}: {value!r} is not a table")
    return value


def _number(where: str, key: str, value: object) -> float:
    """Return a number within its range; `key` is its place in `RANGES`."""
    return RANGES[key].check(f"{where}: {key}", value, CardError)


def _section(name: str, document: Mapping[str, object], key: str, kind: type[Section]) -> Section:
    table = _table(f"{name}: [{key}]", document.get(key, {}))
    allowed = {f.name: f.type for f in fields(kind)}
    values: dict[str, Any] = {}  # numbers and switches, checked below
    for entry, value in table.items():
        if entry not in allowed:
            raise CardError(
                f"{name}: unknown {key}.{entry}, expected one of {', '.join(sorted(allowed))}"
            )
        if allowed[entry] == "bool":
            if not isinstance(value, bool):
                raise CardError(f"{name}: {key}.{entry} is {value!r}, expected true or false")
            values[entry] = value
        else:
            values[entry] = _number(name, f"{key}.{entry}", value)
    return kind(**values)


def _segments(where: str, value: object) -> list[Segment]:
    table = dict(_table(where, value))
    kind = table.pop("kind", None)
    if kind not in ("trim", "turn", *KINDS):
        raise CardError(f"{where}: kind is {kind!r}, expected trim, turn, {', '.join(KINDS)}")
    repeat = table.pop("repeat", 1)
    if not isinstance(repeat, int) or not 1 <= repeat <= 100:
        raise CardError(f"{where}: repeat is {repeat!r}, expected 1 to 100")
    axis = table.pop("axis", [])
    axes = [axis] if isinstance(axis, str) else axis
    if not isinstance(axes, list) or any(name not in AXES for name in axes):
        raise CardError(f"{where}: axis is {axis!r}, expected of {', '.join(AXES)}")
    amplitude = table.pop("amplitude", [])
    listed = amplitude if isinstance(amplitude, list) else [amplitude]
    amplitudes = tuple(_number(where, "segment.amplitude", x) for x in listed)
    tones = _tones(where, str(kind), axes, table.pop("tones", []))
    numbers: dict[str, float] = {}
    allowed = ("duration_s", "bank_deg", "width_s", "low_hz", "high_hz", "before_s",
               "airspeed_mps", "attention")  # fmt: skip
    for key, x in table.items():
        if key not in allowed:
            raise CardError(f"{where}: unknown key {key!r}, expected one of {', '.join(allowed)}")
        numbers[key] = _number(where, f"segment.{key}", x)
    if kind in KINDS and (not axes or len(axes) != len(amplitudes)):
        raise CardError(
            f"{where}: {len(axes)} axes and {len(amplitudes)} amplitudes, expected one each"
        )
    if kind in STEPS:
        needed: tuple[str, ...] = ("width_s",)
    elif kind in KINDS and not tones:
        needed = ("duration_s", "low_hz", "high_hz")
    else:
        needed = ("duration_s",)
    for key in needed:
        if numbers.get(key, 0.0) <= 0.0:
            raise CardError(f"{where}: {kind} needs {key} above 0, found {numbers.get(key)!r}")
    if "low_hz" in needed and numbers["high_hz"] <= numbers["low_hz"]:
        raise CardError(f"{where}: high_hz is {numbers['high_hz']!r}, expected above low_hz")
    if kind == "multisine" and not tones:
        band = harmonics(numbers["duration_s"], numbers["low_hz"], numbers["high_hz"])
        if len(band) > MOST_TONES:
            raise CardError(
                f"{where}: {len(band)} whole multiples of 1/duration_s between low_hz and high_hz,"
                f" expected up to {MOST_TONES}: a shorter input or a narrower band"
            )
        if len(band) < len(axes):
            raise CardError(
                f"{where}: {len(band)} whole multiples of 1/duration_s between low_hz and high_hz"
                f" for {len(axes)} axes, expected at least one each: a longer input or a wider band"
            )
    point = Segment(str(kind), axes=tuple(axes), amplitudes=amplitudes, tones=tones, **numbers)
    return [point] * repeat


def _tones(where: str, kind: str, axes: list[str], value: object) -> tuple[Tone, ...]:
    """Return the tones of a multisine, ``[axis, harmonic, share, phase_turn]`` each."""
    if value == []:
        return ()
    if not isinstance(value, list) or kind != "multisine" or len(value) > MOST_TONES:
        raise CardError(
            f"{where}: tones of {kind}, expected a list of up to {MOST_TONES} of a multisine"
        )
    tones = tuple(_tone(where, axes, one) for one in value)
    missing = [axis for axis in axes if axis not in {tone.axis for tone in tones}]
    if missing:
        raise CardError(f"{where}: tones have none of {missing[0]}, expected one of each axis")
    return tones


def _tone(where: str, axes: list[str], value: object) -> Tone:
    match value:
        case [str(axis), int(harmonic), int() | float() as share, int() | float() as phase] if (
            axis in axes and 1 <= harmonic <= MOST_TONES
        ):
            share = _number(where, "segment.tone_share", share)
            return Tone(axis, harmonic, share, _number(where, "segment.tone_phase", phase))
    raise CardError(
        f"{where}: tone {value!r}, expected [axis, harmonic, share, phase in turns] of its axes"
    )


def _fault(where: str, value: object) -> Fault:
    table = dict(_table(where, value))
    kind = table.pop("kind", None)
    if not isinstance(kind, str) or kind not in FAULTS:
        raise CardError(f"{where}: kind is {kind!r}, expected one of {', '.join(FAULTS)}")
    about = FAULTS[kind]
    channel = table.pop("channel", "")
    if channel and channel not in about.channels:
        known = ", ".join(about.channels) or "none"
        raise CardError(f"{where}: channel is {channel!r}, expected of {known}")
    allowed = ("at_s", "duration_s", "value") if about.lasts else ("at_s", "value")
    for key in table:
        if key not in allowed:
            raise CardError(
                f"{where}: unknown key {key!r} of {kind}, expected one of"
                f" {', '.join((*allowed, 'channel') if about.channels else allowed)}"
            )
    numbers = {key: _number(where, f"fault.{key}", x) for key, x in table.items()}
    if about.from_start:
        if numbers.setdefault("at_s", 0.0) != 0.0:
            raise CardError(f"{where}: {kind} stands at power-on, expected at_s = 0 or none")
    elif "at_s" not in numbers:
        raise CardError(f"{where}: {kind} needs at_s")
    return Fault(kind=kind, channel=str(channel), **numbers)
