"""Random flights whose rows hold bank and pitch, in one loop with an aircraft, faults on top.

    python tests/sitl/hold_faults.py --flights 200 --each 10 --seed 49
    python tests/sitl/hold_faults.py --kinds late,biased --each 50 --first 50

A flight is drawn from seed and number alone: the same numbers of another kind are the same flights
with another fault, and a campaign runs in pieces.

Gusts up to 2 m/s, CG 3 % of the chord either way, servos at half their speed in every second
flight, each surface with half to twice the effect that the model has. Judged from true motion,
servo pulses and what was sent: plain pulses within 25 ms of what could be known, bank at most 60
degrees for half a second behind a row, and nothing lost that is kept without the hold.
Each kind's line is printed as it ends or is stopped; 6 if anything was wrong.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from host.log import read_log
from host.twin.recorder.fat32 import CardReader
from host.twin.recorder.sitl_library import TICKS_PER_S
from host.wire.schema_text import packed_schema

from tests.sitl import flight_cards as cards
from tests.sitl.bench import Bench
from tests.sitl.hold_flight import (
    TRIGGER_S,
    Motion,
    World,
    drawn_world,
    fly_closed,
    hold_flight,
)
from tests.sitl.input_faults import BEHIND_S, PLAIN_S, QUIET_S, RESETS, SERVO_S, TRIGGER_SLACK_S
from tests.sitl.input_flight import PACKET_S, InputFlight
from tests.sitl.input_judge import deflected

MOST_GUSTS_MPS = 2.0
PILOT_S = 0.5
MOST_BANK_DEG = 60.0
LOST_BANK_DEG, LOST_PITCH_DEG = 90.0, 60.0
BANK_END, PITCH_END, MOST_ALIKE = 4500, 2500, 4  # core/attitude_hold.h
AILERON, ELEVATOR, RUDDER = 1, 2, 4
# Shape, axes moved, axes held, ms, us.
ROWS = (
    (cards.THREE_TWO_ONE_ONE, ELEVATOR, AILERON, 2100, 80),
    (cards.DOUBLET, AILERON, ELEVATOR, 800, 50),
    (cards.THREE_TWO_ONE_ONE, RUDDER, AILERON | ELEVATOR, 3500, 80),
    (cards.SWEEP, RUDDER, AILERON | ELEVATOR, 6000, 80),
)


@dataclass(slots=True)
class Fault:
    """What is wrong, and from when it can be known; None: it cannot.

    A row that a reset ends has no end in the log: it ended at `reset_s`.
    """

    name: str
    known_s: float | None = None
    within_s: float = PLAIN_S
    acts: list[tuple[float, Callable[[Bench], None]]] = field(default_factory=list)
    reset_s: float | None = None


Draw = Callable[[InputFlight, World, float, int, np.random.Generator], Fault]
Row = NDArray[np.int64]


def nothing(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    return Fault("none")


def reversed_surface(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    """Behind the proof on the ground: a horn that came off its other way round."""
    axes = [k for k in range(2) if held >> k & 1]
    world.gain[int(random.choice(axes))] *= -1.0
    return Fault("one surface reversed")


def turned(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    """By half a turn about z, behind the proof on the ground."""
    sign = np.array([-1, -1, 1, -1, -1, 1, -1, -1, 1])
    world.imu = lambda _, row: row * sign
    return Fault("IMU turned")


def turned_before(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    """As before, and the pilot tilts it on the ground: no row may start."""
    sign = np.array([-1, -1, 1, -1, -1, 1, -1, -1, 1])
    flight.imu = flight.imu * sign
    world.imu = lambda _, row: row * sign
    return Fault("IMU turned, seen on the ground", 0.0)


def frozen(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    kept: list[Row] = []

    def imu(t_s: float, row: Row) -> Row:
        if t_s < at_s:
            return row
        kept.append(row)
        return kept[0]

    world.imu = imu
    # Alike from the first packet behind it on; its START is 4 ms behind, its bytes take 1 ms.
    return Fault("IMU frozen", at_s + MOST_ALIKE * PACKET_S + 0.005)


def silent(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    world.imu = lambda t_s, row: row if t_s < at_s else None
    return Fault("IMU silent", at_s + 0.004 + 0.030)


def late(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    """Old values in fresh packets, by up to 25 ms: nothing tells."""
    past: list[Row] = []
    by = int(random.integers(1, 6))

    def imu(_: float, row: Row) -> Row:
        past.append(row)
        return past[max(0, len(past) - 1 - by)]

    world.imu = imu
    return Fault("IMU late")


def biased(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    off = np.zeros(9, dtype=np.int64)
    off[6:8] = random.choice([-500, 500], 2)
    world.imu = lambda _, row: row + off
    return Fault("IMU 5 deg off")


def pitot(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    row = int(at_s / 0.005) + 1
    flight.analog[row:, 4] = flight.analog[row, 4].round()
    return Fault("pitot blocked", row * 0.005 + 0.016 + 0.5 + 0.016)


def barometer(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    row = int(at_s / 0.01) + 1
    flight.up[row:] = flight.up[row].round()
    # Asked each 40 ms, converted twice.
    return Fault("barometer stuck", row * 0.01 + 0.085 + 0.5 + 0.016)


def receiver(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    frame = math.ceil(at_s / flight.frame_s)
    flight.width_us[frame:] = flight.width_us[frame]
    return Fault("receiver that holds")


def brown_out(
    flight: InputFlight, world: World, at_s: float, held: int, random: np.random.Generator
) -> Fault:
    source = int(random.choice(RESETS))
    # A turn of the loop, 1 ms at most, later than asked.
    return Fault(
        "brown-out", at_s + 0.006, PLAIN_S, [(at_s, lambda bench: bench.sitl.reset(source))], at_s
    )


FAULTS: tuple[Draw, ...] = (
    reversed_surface, turned, turned_before, frozen, silent, late, biased, pitot, barometer,
    receiver, brown_out,
)  # fmt: skip
KINDS: tuple[Draw, ...] = (nothing, *FAULTS)
HEAD = """\
| fault | flights | begun | most bank in the row, 0.5 s behind it, deg \
| plain behind what is known, ms | ends | wrong |
| --- | --- | --- | --- | --- | --- | --- |"""


@dataclass(frozen=True, slots=True)
class Flown:
    """What came of one flight."""

    fault: str
    wrong: tuple[str, ...]
    begun: bool
    reason: str
    bank_deg: float  # most, in the row
    behind_deg: float  # in the pilot's first half second
    plain_s: float | None


def _card(row: tuple[int, int, int, int, int], *, held: bool) -> bytes:
    shape, axes, holds, duration_ms, size_us = row
    chz = {"first_chz": 30, "last_chz": 200} if shape == cards.SWEEP else {}
    one = cards.row(
        shape=shape, axes=axes | (holds << 4 if held else 0), duration_ms=duration_ms,
        quiet_ms=round(1000 * QUIET_S),
        amplitude_us=tuple(size_us if axes >> k & 1 else 0 for k in range(3)), **chz,
    )  # fmt: skip
    return cards.card([one], hold=cards.HOLD if held else None)


def _drawn(
    number: int, seed: int, draw: Draw
) -> tuple[tuple[int, int, int, int, int], InputFlight, World, Fault]:
    random = np.random.default_rng([seed, number])
    row = ROWS[int(random.integers(0, len(ROWS)))]
    seconds = TRIGGER_S + QUIET_S + row[3] / 1000 + BEHIND_S
    flight = hold_flight(seconds, random)
    world = drawn_world(random, float(random.uniform(0.0, MOST_GUSTS_MPS)))
    at_s = float(random.uniform(TRIGGER_S - 0.1, TRIGGER_S + QUIET_S + row[3] / 1000))
    return row, flight, world, draw(flight, world, at_s, row[2], random)


def _ended(bench: Bench) -> tuple[float | None, float | None, str]:
    """Return begin and end of the row, s, and why; a row that was refused has no begin."""
    # pyfatfs, which the bench reads with, takes a sixth of a flight's time.
    card = CardReader(bytes(bench.image))
    file = min(card.files(), key=lambda file: file.name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file.name
        path.write_bytes(card.read(file))
        events = read_log(path).frames["event"]
    codes = packed_schema().enums["event"]
    reasons = {v: k for k, v in packed_schema().enums["input_end"].items()}
    begun = ended = None
    why = "no trigger"
    for event in events:
        code, at_s = int(event["code"]), 1e-6 * float(event["t_us"])
        if code == codes["input_start"]:
            begun = at_s
        elif code in (codes["input_end"], codes["input_refused"]):
            ended = at_s
            why = reasons.get(int(event["arg"]) >> 8 & 255, "?")
        elif code == codes["card_refused"]:
            why = "card refused"
    return begun, ended, why


def fly(number: int, seed: int, draw: Draw) -> Flown:
    """Fly one drawn flight and judge it."""
    row, flight, world, fault = _drawn(number, seed, draw)
    bench, motion, seen = _fly(row, flight, world, fault, held=True)
    begun_s, ended_s, reason = _ended(bench)
    end_s = TRIGGER_S + QUIET_S + row[3] / 1000 + TRIGGER_SLACK_S
    if begun_s is not None and ended_s is not None:
        end_s = ended_s
    elif fault.reset_s is not None:
        end_s = min(end_s, fault.reset_s)
    bank, behind, lost = _motion(motion, end_s)
    wrong = []
    known = [TRIGGER_S + QUIET_S + row[3] / 1000 + TRIGGER_SLACK_S]
    if fault.known_s is not None:
        known.append(fault.known_s)
    if begun_s is not None:
        known += [at_s for at_s, sent in seen if at_s > begun_s and _beyond(sent, row[2])][:1]
    known_s = min(known)
    pulses = bench.sitl.pulses()
    late_pulses = deflected(pulses, flight, max(TRIGGER_S, known_s))
    plain_s = (
        None if late_pulses.size == 0 else float(late_pulses[-1]) / TICKS_PER_S + SERVO_S - known_s
    )
    if plain_s is not None and plain_s > fault.within_s:
        wrong.append(f"{fault.name}: plain {1000 * plain_s:.1f} ms behind")
    if fault.known_s == 0.0 and begun_s is not None:
        wrong.append("a row started")
    if begun_s is not None and reason == "no trigger" and fault.name != "brown-out":
        wrong.append("no end in the log")
    if begun_s is not None and (behind > MOST_BANK_DEG or lost):
        row, flight, world, fault = _drawn(number, seed, draw)
        _, motion, _ = _fly(row, flight, world, fault, held=False)
        alone = _motion(motion, end_s)
        if lost and not alone[2]:
            wrong.append(f"lost (bank {bank:.0f} deg), and not without the hold ({alone[0]:.0f})")
        if behind > MOST_BANK_DEG:
            wrong.append(f"bank {behind:.0f} deg behind the row, {alone[1]:.0f} without the hold")
    return Flown(fault.name, tuple(wrong), begun_s is not None, reason, bank, behind, plain_s)


def _beyond(sent: Row, held: int) -> bool:
    """Return whether a sample ends a row that holds these axes."""
    ends = False
    for k, most in enumerate((BANK_END, PITCH_END)):
        angle = int(sent[6 + k])
        soon = angle + (int(sent[k]) >> 2) if held >> k & 1 else angle
        ends = ends or max(abs(angle), abs(soon)) > most
    return ends


def _fly(
    row: tuple[int, int, int, int, int],
    flight: InputFlight,
    world: World,
    fault: Fault,
    *,
    held: bool,
) -> tuple[Bench, Motion, list[tuple[float, Row]]]:
    bench = Bench()
    bench.sitl.set_eeprom(cards.eeprom_with(_card(row, held=held)))
    seen: list[tuple[float, Row]] = []
    given = world.imu

    def imu(t_s: float, values: Row) -> Row | None:
        sent = given(t_s, values)
        if sent is not None:
            # Its START is 4 ms behind, and its bytes take 1 ms.
            seen.append((t_s + 0.005, sent))
        return sent

    world.imu = imu
    return bench, fly_closed(bench, flight, world, list(fault.acts)), seen


def _motion(motion: Motion, end_s: float) -> tuple[float, float, bool]:
    """Return most bank in the row and behind it, deg, and whether the flight is lost."""
    bank, pitch = np.degrees(np.abs(motion.bank_rad)), np.degrees(np.abs(motion.pitch_rad))
    inside = (motion.t_s >= TRIGGER_S) & (motion.t_s <= end_s)
    behind = (motion.t_s > end_s) & (motion.t_s <= end_s + PILOT_S)
    both = inside | behind
    lost = bool((bank[both] > LOST_BANK_DEG).any() or (pitch[both] > LOST_PITCH_DEG).any())
    return (
        float(bank[inside].max(initial=0.0)),
        float(bank[behind].max(initial=0.0)),
        lost,
    )


def table_row(name: str, flights: list[Flown]) -> str:
    """Return the line of one kind."""
    begun = [f for f in flights if f.begun]
    bank = max((f.bank_deg for f in begun), default=0.0)
    behind = max((f.behind_deg for f in begun), default=0.0)
    last = max((f.plain_s for f in flights if f.plain_s is not None), default=None)
    ends = ", ".join(f"{why} {n}" for why, n in Counter(f.reason for f in flights).most_common())
    said = "-" if last is None else f"{1000 * last:.1f}"
    wrong = sum(bool(f.wrong) for f in flights)
    return (
        f"| {name} | {len(flights)} | {len(begun)} | {bank:.0f}, {behind:.0f} | {said} |"
        f" {ends} | {wrong} |"
    )


def fly_kind(draw: Draw, numbers: range, seed: int) -> list[Flown]:
    """Fly one kind and print its line, of what was flown also if it is stopped.

    Raises
    ------
    StoppedError
        By a signal; the line stands.
    """
    flights: list[Flown] = []
    try:
        for number in numbers:
            flown = fly(number, seed, draw)
            flights.append(flown)
            for line in flown.wrong[:3]:
                print(f"{draw.__name__} {number}: {line}", file=sys.stderr, flush=True)
    except StoppedError:
        go_on = numbers.start + len(flights)
        print(f"stopped: --kinds {draw.__name__} --first {go_on} goes on", file=sys.stderr)
        raise
    finally:
        if flights:
            print(table_row(flights[0].fault, flights), flush=True)
    return flights


class StoppedError(Exception):
    """A signal asked for the end."""


def _stop(number: int, frame: object) -> None:
    raise StoppedError(number)


def _kinds(text: str) -> list[Draw]:
    known = {draw.__name__: draw for draw in KINDS}
    unknown = [name for name in text.split(",") if name not in known]
    if unknown:
        raise argparse.ArgumentTypeError(f"no kind {unknown[0]}; known: {', '.join(known)}")
    return [known[name] for name in text.split(",")]


def main() -> int:
    """Fly, print the table line by line, return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--flights", type=int, default=2000, help="without a fault")
    parser.add_argument("--each", type=int, default=100, help="of each fault")
    parser.add_argument("--seed", type=int, default=49)
    parser.add_argument("--first", type=int, default=0, help="number of each kind's first flight")
    parser.add_argument("--kinds", type=_kinds, default=KINDS,
                        help="with commas: " + ", ".join(d.__name__ for d in KINDS))  # fmt: skip
    options = parser.parse_args()
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, _stop)
    print(HEAD, flush=True)
    bad = False
    try:
        for draw in options.kinds:
            count = options.flights if draw is nothing else options.each
            numbers = range(options.first, options.first + count)
            flights = fly_kind(draw, numbers, options.seed)
            bad = bad or any(f.wrong for f in flights)
    except StoppedError as stop:
        return 128 + int(stop.args[0])
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
