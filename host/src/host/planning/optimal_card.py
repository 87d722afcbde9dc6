"""`host plan --optimal`: the card that reaches the wanted half-widths in the least time.

Every axis is moved at once, on harmonics of its own, so that all derivatives share the minutes
(Morelli, Journal of Aircraft 49, 2012). Powers are those of `tone_design`, amplitudes are found by
flying the card on drawn aircraft: the worst of them keeps the excursions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from host.aircraft.airframe import Array
from host.aircraft.file import Aircraft
from host.aircraft.prior.prior_file import read_prior
from host.aircraft.prior.prior_table import PriorError
from host.aircraft.trim import solve
from host.arrays import IntArray
from host.constants import NORMAL_95
from host.planning.card_design import TARGET_EXCURSIONS, mode_widths_s
from host.planning.card_planning import Point, exact, point_of
from host.planning.prior_range import random_aircraft, with_prior
from host.planning.tone_design import phases, powers, relative_variances
from host.planning.tone_information import BLOCKS, ToneTable, tone_table
from host.twin.flight.fly import fly
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card, Pilot, Segment, Tone, length_s

AIRCRAFT = 8  # drawn, for the design
FIRST_DRAW = 980_001
# Pulse frames of 20 ms allow 5 Hz, where 1 ms of delay that nobody knows is 1.8 deg of phase.
HIGHEST_HZ, LOWEST_HZ = 3.5, 0.2  # slower is the pilot's and the phugoid's
TONES = {"longitudinal": (3,), "lateral": (3, 4)}  # ten in a row of the logger's card
SHARES = 64  # steps of a share of the amplitude there
DURATION_S = 12.0  # hands off: longer, and bank and speed wander
QUIET_S, REST_S = 1.5, 1.0  # before it and behind it; a 3-2-1-1 needs its free response
WANTED_SHARE = 0.10
STEPS = 2  # to the largest amplitudes
MOST_POINTS = 12
# What is flown by the logger: exact, on the receiver's frames; the pilot only watches.
LOGGER = Pilot(timing_s=0.0, amplitude=0.0, drift=0.0, hand_s=0.02, early=0.0)
WATCHING = replace(LOGGER, hands_off_s=REST_S)


@dataclass(frozen=True, slots=True)
class OptimalCard:
    """A designed card and what it was designed to.

    Attributes
    ----------
    card : Card
    point_s : float
        Length of one point, trim and rest with it.
    seconds : (aircraft,) array
        Until noise and gusts leave the wanted half-widths, of each drawn aircraft; linear theory.
    """

    card: Card
    point_s: float
    seconds: Array

    def line(self) -> str:
        """Return in words how long it takes."""
        low, middle, high = np.quantile(self.seconds, (0.1, 0.5, 0.9))
        return (
            f"{len(self.seconds)} aircraft of the prior's range: {middle:.0f} s of flight to the"
            f" wanted half-widths ({low:.0f} to {high:.0f}) by linear theory, tolerances apart;"
            f" {self.point_s:.1f} s a point"
        )


def optimal_card(
    aircraft: Aircraft,
    airspeed_mps: float = 0.0,
    *,
    gusts_mps: float = 0.3,
    wanted_share: float = WANTED_SHARE,
    duration_s: float = DURATION_S,
    fleet: Sequence[Aircraft] = (),
) -> OptimalCard:
    """Design a card for an aircraft from its prior and the prior's range.

    Parameters
    ----------
    aircraft : Aircraft
    airspeed_mps : float
        0: the aircraft file's.
    gusts_mps : float
        Standard deviation of the vertical gust.
    wanted_share : float
        95 % half-width of the principal derivatives over their values.
    duration_s : float
        Length of one multisine; at most 20 s fit a row of the logger's card.
    fleet : sequence of Aircraft
        For which it is designed, in place of aircraft drawn from the prior's range.

    Raises
    ------
    AircraftError, TrimError
        The aircraft cannot be trimmed at that airspeed.
    """
    speed = airspeed_mps or aircraft.scalar("trim.airspeed_mps")
    fleet = fleet or _fleet(aircraft)
    harmonics = np.arange(math.ceil(LOWEST_HZ * duration_s), int(HIGHEST_HZ * duration_s) + 1)
    rng = np.random.default_rng([FIRST_DRAW, len(harmonics)])
    taken: set[int] = set()
    blocks: list[_Block] = []
    for name, each in TONES.items():
        tables = [tone_table(a, name, speed, gusts_mps, harmonics / duration_s) for a in fleet]
        number = np.tile(harmonics, len(BLOCKS[name]))
        weights = powers(tables, name, ~np.isin(number, list(taken)), each)
        taken |= set(number[weights > 0.0].tolist())
        blocks.append(_Block(name, tables, weights, *_tones(name, tables[0], number, weights, rng)))
    amplitudes = {axis: size for b in blocks for axis, size in b.amplitudes_deg.items()}
    point = Segment(
        "multisine",
        axes=tuple(amplitudes),
        amplitudes=tuple(amplitudes.values()),
        duration_s=duration_s,
        before_s=QUIET_S,
        attention=0.0,
        tones=tuple(tone for b in blocks for tone in b.tones),
    )
    card = within_limits(_card(aircraft, speed, [point], WATCHING), fleet)
    point = card.segments[1]
    point_s = length_s(card, point)
    scaled = dict(zip(point.axes, point.amplitudes, strict=True))
    # Variance of the widest wanted derivative over its square, of one point, for each aircraft.
    variance = [
        max(b.widest(k, (scaled[axis] / size) ** 2) for b in blocks
            for axis, size in list(b.amplitudes_deg.items())[:1])
        for k in range(len(fleet))
    ]  # fmt: skip
    seconds = np.array(variance) * point_s / duration_s * (NORMAL_95 / wanted_share) ** 2
    points = min(max(math.ceil(float(np.median(seconds)) / point_s), 1), MOST_POINTS)
    many = "one orthogonal multisine" if points == 1 else f"{points} orthogonal multisines"
    title = f"{aircraft.title}: {many} on three axes, for its prior's range"
    whole = _card(aircraft, speed, [point] * points, WATCHING)
    return OptimalCard(replace(whole, title=title), point_s, seconds)


@dataclass(frozen=True, slots=True)
class _Block:
    """Axes that move together, on every drawn aircraft: powers, amplitudes and tones."""

    name: str
    tables: list[ToneTable]
    weights: Array
    amplitudes_deg: dict[str, float]
    tones: list[Tone]

    def widest(self, aircraft: int, times: float) -> float:
        """Return the largest relative variance of a second, with so many times the power."""
        weights = 2.0 * times * self.weights
        return float(relative_variances(self.tables[aircraft], self.name, weights).max())


def _fleet(aircraft: Aircraft) -> list[Aircraft]:
    """Return the aircraft and some of its prior's range."""
    return [aircraft, *(random_aircraft(aircraft, FIRST_DRAW + k) for k in range(AIRCRAFT - 1))]


def _tones(
    block: str, table: ToneTable, number: IntArray, weights: Array, rng: np.random.Generator
) -> tuple[dict[str, float], list[Tone]]:
    """Return amplitudes (deg) and tones of each surface, in steps of the logger's card."""
    chosen = np.flatnonzero(weights > 1e-3 * weights.max())
    amplitude, harmonic = np.sqrt(2.0 * weights[chosen]), number[chosen]
    turns = phases(_rows(table, chosen), amplitude, harmonic, rng)
    sizes, tones = {}, []
    for k, surface in enumerate(BLOCKS[block]):
        own = table.axis[chosen] == k
        peak = _peak(harmonic[own], amplitude[own], turns[own])
        sizes[surface] = math.degrees(peak)
        steps = np.clip(np.floor(SHARES * amplitude[own] / peak), 1.0, SHARES - 1.0)
        tones += [
            Tone(surface, int(h), float(n) / SHARES, float(t))
            for h, n, t in zip(harmonic[own], steps, turns[own], strict=True)
        ]
    return sizes, tones


def prior_of(
    aircraft: Aircraft, path: Path, airspeed_mps: float = 0.0
) -> tuple[Aircraft, list[str]]:
    """Return the aircraft with the coefficients of a prior's file, and their names.

    Raises
    ------
    PriorError
        If the file cannot be read, or has no coefficient of an aircraft file.
    """
    speed = airspeed_mps or aircraft.scalar("trim.airspeed_mps")
    alpha_rad = solve(aircraft.airframe(), speed).alpha_rad
    found, replaced = with_prior(aircraft, read_prior(path, speed), alpha_rad)
    if not replaced:
        raise PriorError(f"{path}: no coefficient of an aircraft file; expected such as Cm_alpha")
    return found, replaced


def _card(
    aircraft: Aircraft, airspeed_mps: float, points: list[Segment], pilot: Pilot = LOGGER
) -> Card:
    rest = [Segment("trim", duration_s=x) for x in (4.0, 3.0)]
    card = Card(name="plan", title="", aircraft=aircraft.name, segments=(rest[0], *points, rest[1]),
                pilot=pilot)  # fmt: skip
    return replace(card, flight=replace(card.flight, airspeed_mps=airspeed_mps))


def _rows(table: ToneTable, chosen: IntArray) -> ToneTable:
    return ToneTable(
        table.axis[chosen], table.frequency_hz[chosen], table.information[chosen], table.value,
        table.response[chosen],
    )  # fmt: skip


def _peak(harmonic: IntArray, amplitude: Array, turns: Array) -> float:
    at = np.arange(1024) / 1024.0
    return float(np.abs(np.sin(2.0 * np.pi * (np.outer(at, harmonic) + turns)) @ amplitude).max())


def standard_card(aircraft: Aircraft, airspeed_mps: float = 0.0, repeat: int = 1) -> Card:
    """Return the card that is beaten: a 3-2-1-1 on each axis within the same excursions.

    Widths are those of `card_design.design`, by the modes of the nominal aircraft; amplitudes
    keep the excursions on the same drawn aircraft.
    """
    speed = airspeed_mps or aircraft.scalar("trim.airspeed_mps")
    points = [
        Segment("3211", axes=(axis,), amplitudes=(3.0,), width_s=width, before_s=QUIET_S)
        for axis, width in mode_widths_s(aircraft, speed).items()
    ]
    title = f"{aircraft.title}: 3-2-1-1 on each axis"
    scaled = limited_points(aircraft, speed, points)
    return replace(_card(aircraft, speed, scaled * repeat), title=title)


def limited_points(
    aircraft: Aircraft, airspeed_mps: float, points: Sequence[Segment]
) -> list[Segment]:
    """Return test points as large as the aircraft and drawn ones of its prior's range allow."""
    card = _card(aircraft, airspeed_mps, list(points))
    return list(within_limits(card, _fleet(aircraft)).segments[1:-1])


def within_limits(card: Card, fleet: Sequence[Aircraft]) -> Card:
    """Return the card with amplitudes at which the worst of a fleet just keeps the excursions.

    Flights are exact and in calm air; excursions grow with the amplitudes, so two steps do. The
    elevator answers for alpha, aileron and rudder for sideslip and bank.
    """
    for _ in range(STEPS):
        worst = iter(np.max([_excursions(card, aircraft) for aircraft in fleet], axis=0))
        scaled = [
            s if s.kind == "trim" else _scaled(s, next(worst), fleet[0]) for s in card.segments
        ]
        card = replace(card, segments=tuple(scaled))
    return card


def _excursions(card: Card, aircraft: Aircraft) -> list[tuple[float, float]]:
    """Return the excursions of each point over what is allowed."""
    flown = [s for s in card.segments if s.kind != "trim"]
    record = fly(exact(card), aircraft=aircraft)
    data = air_data(record)
    windows = record.schedule.windows
    return [_over(point_of(record, data, s, w)) for s, w in zip(flown, windows, strict=True)]


def _over(point: Point) -> tuple[float, float]:
    """Return the largest longitudinal and lateral excursion over what is allowed."""
    allowed = TARGET_EXCURSIONS
    beta, bank = point.beta_deg / allowed["beta_deg"], point.bank_deg / allowed["bank_deg"]
    return point.alpha_deg / allowed["alpha_deg"], max(beta, bank)


def _scaled(s: Segment, over: Array, aircraft: Aircraft) -> Segment:
    sizes = [
        min(
            x / float(over[0 if axis == "elevator" else 1]),
            0.5 * math.degrees(aircraft.scalar(f"surfaces.{axis}_limit_rad")),
        )
        for axis, x in zip(s.axes, s.amplitudes, strict=True)
    ]
    return replace(s, amplitudes=tuple(round(x, 2) for x in sizes))
