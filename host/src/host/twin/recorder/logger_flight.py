"""A flight whose inputs the logger flies: aircraft and recorder are run in turns.

The aircraft flies with the inputs that the logger added, then the recorder runs through that
flight, until neither changes. The inputs follow from clock and card, so two rounds are enough, or
three where a limit ended an input. A card that holds axes feeds back: there the recorder runs
along with the aircraft (`closed_loop`), and only what its limits watch is a round older.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from host.aircraft.airframe import Array
from host.aircraft.file import Aircraft
from host.aircraft.linear_aircraft import load
from host.errors import UsageError
from host.log import read_log
from host.twin.flight.fly import STEP_S, FlightRecord, fly
from host.twin.flight.pilot import WINDOW_TAIL_S, Window
from host.twin.recorder.closed_loop import ClosedLoop
from host.twin.recorder.sitl import Recording, recorder_rate_hz
from host.twin.recorder.stimuli import Stimuli, stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.sensors.mega_clock import TICKS_PER_S, clock_share
from host.twin.testcard.cards import Card, input_s
from host.twin.testcard.flown_by_logger import flown_by_logger
from host.wire.flight_card import AXES, CardFile, card_faults, read_card
from host.wire.schema_text import packed_schema

MOST_ROUNDS = 5
KINDS = {"three_two_one_one": "3211"}
# A row begins with a pulse of the switch, which follows the sticks' pulses by their few us.
SAME_US = 1000
BEHIND_S = 0.05  # the last pulse of a row, behind its end


@dataclass(frozen=True, slots=True)
class LoggedInput:
    """One row of the flight card, as the log's events date it.

    Attributes
    ----------
    row : int
    start_us, end_us : int
        Trigger and end, the recorder's clock.
    reason : int
        `input_end` of the protocol.
    """

    row: int
    start_us: int
    end_us: int
    reason: int


def logger_flight(
    flight_card: bytes,
    card: Card,
    *,
    seed: int,
    recorder: Callable[[FlightRecord, Stimuli], Recording],
    aircraft: Aircraft | None = None,
) -> tuple[FlightRecord, Stimuli, Recording]:
    """Fly a card whose inputs the logger flies.

    Parameters
    ----------
    flight_card : bytes
        Flight card in the logger, made from `card` by `host plan --card`.
    card : Card
    seed : int
    recorder : callable
        Runs the recorder with that flight card through the stimuli of a flight. It is not called
        with a card that holds axes: the recorder of this computer flies along.
    aircraft : Aircraft, optional
        In place of the card's.

    Returns
    -------
    FlightRecord
        Its windows are the rows that were flown.
    Stimuli, Recording
        Those of the last round, in which the added inputs no longer changed.

    Raises
    ------
    UsageError
        The flight card is not of this card, nothing was recorded, or no agreement.
    """
    wrong = card_faults(flight_card)
    if wrong:
        raise UsageError(f"no good flight card: {wrong[0]}")
    rows = read_card(flight_card)
    holds = rows.hold is not None
    if holds and card.faults:
        raise UsageError(
            f"{card.name} has {card.faults[0].kind}, and a flight card that holds axes is flown"
            " without faults here: leave them out, or make it without --hold"
        )
    _same_inputs(rows, card)
    plane = aircraft or load(card.aircraft)
    speed = card.flight.airspeed_mps or plane.scalar("trim.airspeed_mps")
    legs = flown_by_logger(card, speed, float(rows.head["distance_max_m"]), holds=holds)
    added = np.zeros((0, len(AXES)))
    before: list[LoggedInput] | None = None
    if holds:
        flown = fly(legs, seed=seed, aircraft=plane, added_us=added)
        given = stimuli(flown, air_data(flown))
    for _ in range(MOST_ROUNDS):
        if holds:
            loop = ClosedLoop(
                given, rate_hz=recorder_rate_hz(card.flight.rate_hz), aircraft=plane.name,
                flight_card=flight_card, seed=seed,
            )  # fmt: skip
            flown = fly(legs, seed=seed, aircraft=plane, logger=loop.power_on)
            given, recording = stimuli(flown, air_data(flown)), loop.recording()
        else:
            flown = fly(legs, seed=seed, aircraft=plane, added_us=added)
            given = stimuli(flown, air_data(flown))
            recording = recorder(flown, given)
        if not recording.log:
            raise UsageError(f"nothing was recorded: {recording.name}")
        logged = logged_inputs(recording.log)
        if before is not None and _agree(before, logged):
            return _with_windows(flown, logged, rows), given, recording
        before = logged
        if not holds:
            added = added_us(flown, given, recording, logged)
    raise UsageError("aircraft and logger do not settle on what the logger adds")


def _agree(before: list[LoggedInput], now: list[LoggedInput]) -> bool:
    """Return whether two rounds flew the same rows at the same times."""
    return len(before) == len(now) and all(
        (a.row, a.reason) == (b.row, b.reason)
        and max(abs(a.start_us - b.start_us), abs(a.end_us - b.end_us)) <= SAME_US
        for a, b in zip(before, now, strict=True)
    )


def _same_inputs(rows: CardFile, card: Card) -> None:
    """Raise UsageError where a flight card was not made of this card."""
    inputs = [s for s in card.segments if s.kind not in ("trim", "turn")]
    mine = [round(1000.0 * input_s(s)) for s in inputs]
    theirs = [row["duration_ms"] for row in rows.rows]
    if mine != theirs:
        raise UsageError(
            f"the flight card has {len(theirs)} rows of {sum(theirs)} ms, {card.name} {len(mine)}"
            f" inputs of {sum(mine)} ms: make it of the same card, host plan CARD --card FILE"
        )


def logged_inputs(log: bytes) -> list[LoggedInput]:
    """Return the rows that began, in order of time."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.bin"
        path.write_bytes(log)
        decoded = read_log(path)
        codes, events = decoded.schema.enums["event"], decoded.frames["event"]
    found: list[LoggedInput] = []
    begun: tuple[int, int] | None = None
    for event in events:
        code, arg, at = int(event["code"]), int(event["arg"]), int(event["t_us"])
        if code == codes["input_start"]:
            begun = arg & 255, at
        elif code == codes["input_end"] and begun is not None:
            found.append(LoggedInput(*begun, at, arg >> 8 & 255))
            begun = None
    return found


def added_us(
    flown: FlightRecord, given: Stimuli, recording: Recording, rows: list[LoggedInput]
) -> Array:
    """Return what the logger added to the sticks (n, 3), us, at the steps of a flight.

    Each servo pulse is compared with the stick's last pulse before it, from which the recorder
    made it.
    """
    ticks = np.arange(len(flown.t_s)) * STEP_S * (1.0 + clock_share(flown)) * TICKS_PER_S
    added = np.zeros((len(ticks), len(AXES)))
    for k in range(len(AXES)):
        pulses = recording.servos[recording.servos["output"] == k]
        rise, fall = _sticks(given, k)
        place = np.searchsorted(fall, pulses["at"], side="right") - 1
        difference = 0.5 * (pulses["width"] - (fall - rise)[np.maximum(place, 0)])
        ends = pulses["at"] + pulses["width"]
        inside = np.zeros(len(pulses), dtype=bool)
        for row in rows:
            span_us = row.start_us, row.end_us + 1e6 * BEHIND_S
            inside |= (ends >= 2.0 * span_us[0]) & (ends <= 2.0 * span_us[1])
        difference[~inside] = 0.0
        last = np.searchsorted(ends, ticks, side="right") - 1
        added[:, k] = np.where(last >= 0, difference[np.maximum(last, 0)], 0.0)
    return added


def _sticks(given: Stimuli, channel: int) -> tuple[Array, Array]:
    """Return rises and falls of a channel's pulses, in ticks."""
    level = (given.edges["levels"] >> channel) & 1
    change = np.flatnonzero(np.diff(level, prepend=0))
    at = given.edges["at"][change].astype(np.float64)
    whole = len(at) // 2 * 2
    return at[0:whole:2], at[1:whole:2]


def _with_windows(flown: FlightRecord, rows: list[LoggedInput], card: CardFile) -> FlightRecord:
    """Return the flight with the windows of its rows, on true time."""
    names = {
        value: KINDS.get(name, name) for name, value in packed_schema().enums["card_shape"].items()
    }
    per_s = 1e6 * (1.0 + clock_share(flown))
    windows: list[Window] = []
    for n, one in enumerate(rows):
        row = card.rows[one.row]
        start_s = (one.start_us + 1000.0 * row["quiet_ms"]) / per_s
        end_s = one.end_us / per_s
        next_start_s = rows[n + 1].start_us / per_s if n + 1 < len(rows) else float(flown.t_s[-1])
        if end_s <= start_s:
            continue
        axes = tuple(a for a, size in zip(AXES, row["amplitude_us"], strict=True) if size)
        tail_s = min(end_s + WINDOW_TAIL_S, next_start_s)
        windows.append(Window(names[row["shape"]], axes, start_s, end_s, tail_s, end_s))
    return replace(flown, schedule=replace(flown.schedule, windows=windows))
