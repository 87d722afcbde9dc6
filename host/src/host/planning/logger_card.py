"""A flight card as the logger takes it: rows in servo microseconds, limits of the aircraft.

Deflections become pulses by the calibration's lines of the servos, limits of the air data and of
the vanes the counts of the sensors that the logger watches (protocol/flight-card.md).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from host.aircraft.air import atmosphere, density_kgpm3
from host.aircraft.file import Aircraft
from host.aircraft.trim import solve
from host.constants import GRAVITY_MPS2
from host.errors import UsageError
from host.physical.calibration import Calibration
from host.planning.flight_envelope import Envelope
from host.planning.hold_card import HoldGains, hold_part
from host.planning.learning_card import TURNS, learning_parts
from host.planning.onboard_sums import AxisCard
from host.twin.testcard.cards import Card, Segment, input_s
from host.wire.flight_card import (
    AXES,
    HEAD,
    HELD,
    TRAVEL_US,
    card_bytes,
    card_faults,
    number,
    scale,
)
from host.wire.schema_text import packed_schema

SHAPES = {"3211": "three_two_one_one"}
NAME_BYTES = 16
ADC_TOP = 4 * 1023


class LoggerCardError(UsageError):
    """A card that the logger cannot fly: what was found, what was expected."""


def logger_card(
    card: Card,
    aircraft: Aircraft,
    calibration: Calibration,
    envelope: Envelope | None = None,
    learned: Sequence[AxisCard] = (),
    hold: HoldGains | None = None,
) -> bytes:
    """Return the file of a card, good by `host.wire.flight_card.card_faults`.

    Parameters
    ----------
    card : Card
        Trims and turns are the pilot's and are left out.
    aircraft : Aircraft
    calibration : Calibration
        Calibration of the instrument that flies it.
    envelope : Envelope, optional
    learned : sequence of AxisCard
        What the logger learns in flight (`learned_axes`): rows that move the same teach in
        turn the axes that they move.
    hold : HoldGains, optional
        With it every row holds bank and pitch where it does not move their surface, and nothing is
        learned: there is one memory for both.

    Raises
    ------
    LoggerCardError
        With what the logger cannot fly.
    """
    around = envelope or Envelope()
    points = [s for s in card.segments if s.kind not in ("trim", "turn")]
    most = number("card_most_rows")
    if not 1 <= len(points) <= most:
        raise LoggerCardError(
            f"{card.name}: {len(points)} inputs, repeated ones counted; the logger takes 1 to"
            f" {most}"
        )
    rows = [_row(f"{card.name}: input {k + 1}", s, calibration, around.amplitude_share)
            for k, s in enumerate(points)]  # fmt: skip
    if hold is not None:
        learned = ()
        for row in rows:
            row["axes"] |= _held(row) << number("card_held_shift")
    taught = {one.axis: k + 1 for k, one in enumerate(learned)}
    head = _head(card, aircraft, calibration, around, rows)
    data = card_bytes(
        head,
        rows,
        [learning_parts(one) for one in learned],
        _axis_of_row(points, taught),
        None if hold is None else hold_part(hold, calibration, head["amplitude_max_us"][:2]),
    )
    wrong = card_faults(data)
    if wrong:
        raise LoggerCardError(f"{card.name}: {'; '.join(wrong)}")
    return data


def _held(row: Mapping[str, Any]) -> int:
    """Return the bits of the surfaces that a row leaves alone, of those that can be held."""
    return sum(1 << k for k, _ in enumerate(HELD) if not row["axes"] >> k & 1)


def _axis_of_row(points: Sequence[Segment], taught: Mapping[str, int]) -> list[int]:
    """Return which axis each row teaches, 0 for none: of rows that move the same, each in turn."""
    flown: Counter[tuple[str, ...]] = Counter()
    found = []
    for point in points:
        axes = [taught[TURNS[a]] for a in point.axes if TURNS[a] in taught]
        found.append(axes[flown[point.axes] % len(axes)] if axes else 0)
        flown[point.axes] += 1
    return found


def _row(where: str, s: Segment, calibration: Calibration, share: float) -> dict[str, Any]:
    if "throttle" in s.axes:
        raise LoggerCardError(f"{where}: moves the throttle, which the logger never drives")
    amplitude = [0, 0, 0]
    for axis, degrees in zip(s.axes, s.amplitudes, strict=True):
        slope = calibration.lines[f"pulse.{axis}"].slope[0]
        amplitude[AXES.index(axis)] = round(share * math.radians(degrees) / slope)
    row: dict[str, Any] = {
        "shape": packed_schema().enums["card_shape"][SHAPES.get(s.kind, s.kind)],
        "axes": sum(1 << k for k, size in enumerate(amplitude) if size),
        "quiet_ms": round(1000.0 * s.before_s),
        "duration_ms": round(1000.0 * input_s(s)),
        "amplitude_us": amplitude,
    }
    if s.kind == "sweep":
        row |= {"first_chz": round(100.0 * s.low_hz), "last_chz": round(100.0 * s.high_hz)}
    if s.kind == "multisine":
        row["components"] = _components(where, s)
    return row


def _components(where: str, s: Segment) -> list[int]:
    room = number("card_components")
    if not 1 <= len(s.tones) <= room:
        found = f"{len(s.tones)} tones" if s.tones else "a band without tones"
        raise LoggerCardError(
            f"{where}: {found}, expected 1 to {room}, as `host plan --optimal` designs them"
        )
    data: list[int] = []
    for tone in s.tones:
        share = min(max(round(64.0 * tone.share), 1), 63)
        phase = round(256.0 * tone.phase_turn) % 256
        data += [tone.harmonic, phase, 64 * AXES.index(tone.axis) + share]
    return data + [0] * (3 * room - len(data))


def _head(
    card: Card, aircraft: Aircraft, calibration: Calibration, around: Envelope,
    rows: list[dict[str, Any]],
) -> dict[str, Any]:  # fmt: skip
    name = aircraft.name.encode("ascii", "replace")
    if len(name) > NAME_BYTES:
        raise LoggerCardError(f"{aircraft.name}: longer than {NAME_BYTES} letters")
    speed = card.flight.airspeed_mps or aircraft.scalar("trim.airspeed_mps")
    air = atmosphere(card.flight.field_pressure_pa, card.flight.field_temperature_degc)
    density = density_kgpm3(air, card.flight.height_m)
    alpha = math.degrees(solve(aircraft.airframe(), speed, density_kgpm3=density).alpha_rad)
    slowest, fastest = (aircraft.scalar(f"trim.{x}_airspeed_mps") for x in ("minimum", "maximum"))
    counts = {
        "dp": ("dp_a", 0.5 * density * slowest**2, 0.5 * density * fastest**2),
        "alpha": (
            "alpha_a", math.radians(alpha - around.alpha_deg),
            math.radians(alpha + around.alpha_deg),
        ),
        "beta": ("beta_a", math.radians(-around.beta_deg), math.radians(around.beta_deg)),
    }  # fmt: skip
    head: dict[str, Any] = {
        "aircraft": name, "airspeed_input": 4, "alpha_input": 0, "beta_input": 2,
        "still_ms": around.still_ms, "stick_us": around.stick_us, "rail_min": 0,
        "distance_max_m": around.distance_m,
        "frequency_max_chz": round(100.0 * around.frequency_hz),
    }  # fmt: skip
    for field, (channel, low, high) in counts.items():
        line = calibration.lines[f"channel.{channel}"]
        ends = sorted(line.zero[0] + value / line.slope[0] for value in (low, high))
        for end, value in zip(("min", "max"), ends, strict=True):
            raw = round(value / scale(HEAD, f"{field}_{end}"))
            head[f"{field}_{end}"] = min(max(raw, 0), ADC_TOP)
    values = {
        "phi_max": math.radians(around.bank_deg),
        "theta_min": -math.radians(around.pitch_deg),
        "theta_max": math.radians(around.pitch_deg),
        **{f"{a}_max": math.radians(around.rates_degps) for a in "pqr"},
        "az_min": -around.load_most * GRAVITY_MPS2,
        "az_max": -around.load_least * GRAVITY_MPS2,
    }
    head |= {k: round(v / scale(HEAD, k)) for k, v in values.items()}
    weight = GRAVITY_MPS2 * density  # Pa a metre
    head |= {
        "height_min_pa": round(weight * around.height_least_m),
        "height_max_pa": round(weight * around.height_most_m),
    }
    return head | _servos(aircraft, calibration, rows)


def _servos(
    aircraft: Aircraft, calibration: Calibration, rows: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return travel, largest deflection and rate of the servos."""
    low, high, rates = [], [], []
    for axis in AXES:
        line = calibration.lines[f"pulse.{axis}"]
        throw = aircraft.scalar(f"surfaces.{axis}_limit_rad") / abs(line.slope[0])
        low.append(max(math.ceil(line.zero[0] - throw), TRAVEL_US[0]))
        high.append(min(math.floor(line.zero[0] + throw), TRAVEL_US[1]))
        rates.append(aircraft.scalar("servo.rate_limit_radps") / abs(line.slope[0]))
    largest = [max(abs(row["amplitude_us"][k]) for row in rows) for k in range(len(AXES))]
    slopes = [abs(calibration.lines[f"pulse.{axis}"].slope[0]) for axis in AXES]
    most_rad = max(us * slope for us, slope in zip(largest, slopes, strict=True))
    for k, _ in enumerate(HELD):
        # A surface that is held and never moved: as far as the card moves another.
        if largest[k] == 0 and any(row["axes"] >> number("card_held_shift") for row in rows):
            largest[k] = min(math.floor(most_rad / slopes[k]), number("card_most_amplitude_us"))
    rate = min(max(round(min(rates)), 100), 60_000)
    return {
        "servo_min_us": low, "servo_max_us": high, "amplitude_max_us": largest,
        "rate_max_usps": rate,
    }  # fmt: skip
