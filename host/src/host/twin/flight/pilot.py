"""The pilot: from a flight card to stick inputs and corrections on the time grid of the flight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from host.aircraft.airframe import Airframe, Array
from host.aircraft.linearisation import linearise
from host.aircraft.trim import Trim
from host.twin.flight.ground_tilts import PITCHED_S, ROLLED_S, SHOWN_S, TILTING_S
from host.twin.testcard.cards import (
    AXES,
    Card,
    Segment,
    duration_s,
    input_s,
    length_s,
    turns_home,
)
from host.twin.testcard.flown_by_logger import AT_ARMED_S, LEVEL_S, SWITCH_S
from host.twin.testcard.input_shapes import STEPS, staircase
from host.twin.testcard.sine_inputs import sine_inputs

CROSSOVER_RADPS = 1.2  # of attitude control by eye; a person on the ground manages about 1-2 rad/s
WINDOW_TAIL_S = 3.0
BROKEN_OFF = (0.2, 0.7)  # an input broken off ends after a share of its length, drawn evenly
SWITCH_DIRECT_US, SWITCH_MEGA_US, SWITCH_ARMED_US = 1100.0, 1675.0, 1900.0
LET_GO_S = 0.4  # before the trigger the sticks are let go
RELEASED_S = 0.3  # behind the input the switch goes back
# On the ground: each stick to both ends, then the sign that enables a flight card.
STIR_S, SIGN_S, SIGN_END_S = 7.0, 12.0, 15.4
TURN_RAD = math.radians(30.0)  # most bank of a turn until home is ahead
AIM_M = 500.0  # from home, ahead or behind: what a pilot steers at
NOWHERE_M = 1e9
FULL_RAD = 10.0  # larger than any surface limit, so that the surface goes to its end


@dataclass(frozen=True, slots=True)
class Window:
    """One maneuver as it was really flown; times from power-on.

    Attributes
    ----------
    kind, axes : str, tuple of str
    start_s : float
        First departure of the input.
    input_end_s : float
        Last motion of the input.
    end_s : float
        3 s later, or where the next input starts.
    attention_s : float
        When the pilot took over again.
    """

    kind: str
    axes: tuple[str, ...]
    start_s: float
    input_end_s: float
    end_s: float
    attention_s: float


class Orders(NamedTuple):
    """What the pilot means to do, on the time grid of the flight: n steps.

    Attributes
    ----------
    program : (n, 4) array
        Test input added to the sticks: elevator, aileron, rudder (rad), throttle (share).
    attention : (n,) array
        Weight of the pilot's corrections, 0 to 1.
    bank_rad, airspeed_mps : (n,) arrays
        What the pilot wants to see.
    switch_us : (n,) array
        Pulse of the switch channel.
    aim_m : (n, 2) or (0, 2) array
        Place north and east of home that is flown to; `NOWHERE_M` in turns.
    """

    program: Array
    attention: Array
    bank_rad: Array
    airspeed_mps: Array
    switch_us: Array
    aim_m: Array


@dataclass(frozen=True, slots=True)
class Schedule:
    """What the pilot means to do, and the maneuvers that come of it.

    Attributes
    ----------
    orders : Orders
    windows : list of Window
    """

    orders: Orders
    windows: list[Window]


def schedule(
    card: Card,
    airspeed_mps: float,
    step_s: float,
    rng: np.random.Generator,
    *,
    by_logger: bool = False,
    holds: bool = False,
) -> Schedule:
    """Turn a card into the pilot's program, with the errors of a human hand.

    Parameters
    ----------
    card : Card
    airspeed_mps : float
        Airspeed to hold where the card does not state one.
    step_s : float
    rng : numpy Generator
    by_logger : bool
        The logger flies the inputs of a card made by `flown_by_logger`: the pilot enables it on
        the ground, moves the switch and lets go of the sticks.
    holds : bool
        It holds axes: behind the sign the pilot gives stick against each tilt.

    Returns
    -------
    Schedule
    """
    n = round(duration_s(card) / step_s)
    t = np.arange(n, dtype=np.float64) * step_s
    result = Orders(
        program=np.zeros((n, 4)),
        attention=np.ones(n),
        bank_rad=np.zeros(n),
        airspeed_mps=np.full(n, airspeed_mps),
        switch_us=np.full(n, SWITCH_DIRECT_US),
        aim_m=np.full((n if by_logger or any(map(turns_home, card.segments)) else 0, 2), NOWHERE_M),
    )
    heading = math.radians(card.flight.heading_deg)
    ahead = AIM_M * np.array([math.cos(heading), math.sin(heading)])
    if by_logger:
        _enable(t, result)
    if holds:
        _prove(t, result)
    inputs: list[tuple[Segment, float, float, float]] = []
    at = card.flight.ground_s
    for s in card.segments:
        begin, at = at, at + length_s(card, s)
        span = slice(round(begin / step_s), round(at / step_s))
        if s.airspeed_mps > 0.0:
            result.airspeed_mps[span] = s.airspeed_mps
        if turns_home(s):
            result.aim_m[span] = 0.0  # home
            result.bank_rad[span] = TURN_RAD
            continue
        if s.kind == "turn":
            # The wanted bank itself takes a second to roll in and a second to roll out.
            local = t[span] - begin
            share = np.clip(np.minimum(local, s.duration_s - local), 0.0, 1.0)
            result.bank_rad[span] = math.radians(s.bank_deg) * share
            ahead = -ahead
            continue
        if by_logger:
            result.aim_m[span] = ahead
        if s.kind != "trim":
            start = begin + s.before_s
            times = (
                _leave_to_logger(card, s, begin, t, result)
                if by_logger
                else _fly_input(card, s, start, t, result, rng)
            )
            inputs.append((s, *times))
    windows = []
    for i, (s, start, end, again) in enumerate(inputs):
        tail = end + WINDOW_TAIL_S
        if i + 1 < len(inputs):
            tail = min(tail, inputs[i + 1][1])
        windows.append(Window(s.kind, s.axes, start, end, min(tail, n * step_s), again))
    return Schedule(result, windows)


def _enable(t: Array, into: Orders) -> None:
    """Show the travel of the sticks and hold the sign, on the ground."""
    stirring = _span(t, STIR_S, SIGN_S)
    quarter = np.floor(t[stirring] - STIR_S) % 4
    into.program[stirring, :3] = (
        FULL_RAD * np.select([quarter == 0, quarter == 2], [-1.0, 1.0], 0.0)[:, None]
    )
    sign = _span(t, SIGN_S, SIGN_END_S)
    into.program[sign, AXES.index("aileron")] = FULL_RAD
    into.program[sign, AXES.index("rudder")] = -FULL_RAD


def _prove(t: Array, into: Orders) -> None:
    """Give stick against right wing down and nose up, on the ground."""
    for begin_s, axis, stick_rad in (
        (ROLLED_S, "aileron", -FULL_RAD),
        (PITCHED_S, "elevator", FULL_RAD),
    ):
        against = _span(t, begin_s + TILTING_S, begin_s + TILTING_S + SHOWN_S)
        into.program[against, AXES.index(axis)] = stick_rad


def _leave_to_logger(
    card: Card, s: Segment, trigger_s: float, t: Array, into: Orders
) -> tuple[float, float, float]:
    """Trigger one row; return start and end of its shape and when the pilot corrects again."""
    start = trigger_s + s.before_s
    end = start + input_s(s)
    again = end + card.pilot.hands_off_s
    into.switch_us[_span(t, trigger_s - SWITCH_S, t[-1])] = SWITCH_MEGA_US
    into.switch_us[_span(t, trigger_s - AT_ARMED_S, end + RELEASED_S)] = SWITCH_ARMED_US
    # Springs hold a stick that nobody touches.
    into.attention[_span(t, trigger_s - LET_GO_S, again)] = 0.0
    into.aim_m[_span(t, trigger_s - SWITCH_S - LEVEL_S, again)] = NOWHERE_M
    return start, end, again


def _fly_input(
    card: Card, s: Segment, start_s: float, t: Array, into: Orders, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Add one input; return its start, its end and when the pilot corrects again."""
    pilot = card.pilot
    broken_off = False
    if s.kind in STEPS:
        signs = np.array([sign for sign, _ in STEPS[s.kind]])
        lengths = np.array([length for _, length in STEPS[s.kind]]) * s.width_s
        edges = np.concatenate([[0.0], np.cumsum(lengths)])
        edges = edges + rng.normal(0.0, pilot.timing_s, len(edges))
        edges = start_s + np.maximum.accumulate(edges)  # drawn errors must not swap two edges
        broken_off = pilot.breaks_off > 0.0 and rng.random() < pilot.breaks_off
        if broken_off:
            share = rng.uniform(*BROKEN_OFF)
            edges = np.minimum(edges, edges[0] + share * (edges[-1] - edges[0]))
        levels = signs * (1.0 + rng.normal(0.0, pilot.amplitude, len(signs)))
        begin, end = float(edges[0]), float(edges[-1]) + pilot.hand_s
        span = _span(t, begin - 0.1, end + 0.1)
        local = t[span]
        wave = staircase(local, edges, levels, pilot.hand_s)
        # A held stick creeps: the level drifts until the next edge.
        for i, level in enumerate(levels):
            inside = (local >= edges[i] + pilot.hand_s) & (local < edges[i + 1])
            creep = rng.normal(0.0, pilot.drift) * level
            wave[inside] += creep * (local[inside] - edges[i] - pilot.hand_s)
        waves = [wave] * len(s.axes)
        attention = 0.0 if s.attention < 0.0 else s.attention
    else:
        begin, end = start_s, start_s + s.duration_s
        span = _span(t, begin - 0.1, end + 0.1)
        local = t[span] - start_s
        waves = sine_inputs(s, local)
        attention = 0.25 if s.attention < 0.0 else s.attention
    for axis, amplitude, wave in zip(s.axes, s.amplitudes, waves, strict=True):
        size = amplitude if axis == "throttle" else math.radians(amplitude)
        into.program[span, AXES.index(axis)] += size * wave
    again = end + (0.0 if broken_off else pilot.hands_off_s)
    if rng.random() < pilot.early:
        again = begin + rng.uniform(0.6, 1.0) * (end - begin)
    # The pilot lets go half a second before the input and comes back within 0.4 s.
    into.attention[_span(t, begin - 0.5, again)] = attention
    back = _span(t, again, again + 0.4)
    into.attention[back] = attention + (1.0 - attention) * (t[back] - again) / 0.4
    return begin, end, again


def _span(t: Array, first_s: float, last_s: float) -> slice:
    """Return the samples from first to before last."""
    low, high = np.searchsorted(t, [first_s, last_s])
    return slice(int(low), int(high))


def gains(frame: Airframe, trim: Trim) -> Array:
    """Return the pilot's gains: aileron per bank, elevator per pitch error (rad/rad).

    With them every aircraft has the same crossover frequency, as with a pilot who knows it.

    Returns
    -------
    (2,) array
    """
    linear = linearise(frame, trim)
    roll_rate = -linear.lateral_b[1, 0] / linear.lateral_a[1, 1]
    short = linear.longitudinal_a[1:3, 1:3]
    pitch_rate = float(np.linalg.solve(short, -linear.longitudinal_b[1:3, 0])[1])
    return np.array([CROSSOVER_RADPS / roll_rate, CROSSOVER_RADPS / pitch_rate])
