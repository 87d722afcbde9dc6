"""Random flights with a flight card: each one input, and one fault at any instant of it.

    python tests/sitl/input_faults.py --flights 1000 --seed 1

Every sixth row or so holds bank and pitch. Judged from the script alone: no servo pulse that is
neither the pilot's nor the card's, a held surface within its authority, the throttle never, the
travel never left, plain pulses within the limit of the fault, no input behind a reset.
Ends with a table; 6 if anything was wrong.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from host.twin.recorder.sitl_library import TICKS_PER_S, CardFault, Level

from tests.sitl import flight_cards as cards
from tests.sitl.bench import Bench
from tests.sitl.hold_flight import TILTS_S, hold_flight
from tests.sitl.input_flight import (
    ARMED_US,
    DIRECT_US,
    MEGA_US,
    PACKET_S,
    SWITCH,
    TRIGGER_S,
    InputFlight,
    input_flight,
)
from tests.sitl.input_judge import Trigger, deflected, slewed, wrong_pulses
from tests.sitl.input_shapes import shape_of

QUIET_S = 0.2
BEHIND_S = 1.5  # flown on behind the end of the row
TRIGGER_SLACK_S = 0.06  # the armed pulse is accepted, looks are 5 ms apart
PULSE_S = 0.0022 + 0.0003  # its width, and the low behind it that makes it count
PLAIN_S = 0.025
SERVO_S = 0.020  # between two pulses of a servo
RELAY_S = 0.045
FRAMES_S = (0.0143, 0.018, 0.02, 0.0217)
RESETS = (3, 4)  # brown-out, watchdog
ROWS = (
    cards.row(quiet_ms=200, duration_ms=1000),
    cards.row(shape=cards.PULSE, axes=1, quiet_ms=200, duration_ms=500, amplitude_us=(-150, 0, 0)),
    cards.row(shape=cards.THREE_TWO_ONE_ONE, axes=4, quiet_ms=200, duration_ms=1400,
              amplitude_us=(0, 0, 200)),
    cards.row(shape=cards.SWEEP, axes=2, quiet_ms=200, duration_ms=2000, amplitude_us=(0, 120, 0),
              first_chz=50, last_chz=300),
    cards.row(shape=cards.MULTISINE, axes=7, quiet_ms=200, duration_ms=2000,
              amplitude_us=(100, -80, 120),
              components=(2, 0, 40, 5, 77, 20, 3, 10, 64 + 50, 4, 200, 128 + 30, 7, 90, 128 + 30)
              + (0,) * 15),
)  # fmt: skip


HELD_ROW = cards.row(
    shape=cards.THREE_TWO_ONE_ONE, axes=4 | 3 << 4, quiet_ms=200, duration_ms=1400,
    amplitude_us=(0, 0, 150),
)  # fmt: skip
HELD_TICKS = tuple(2.0 * us for us in (*cards.HOLD["authority_us"], 0))


@dataclass(slots=True)
class Fault:
    """One fault: what it is called, when it can be known, how soon the pulses must be plain.

    `within_s` None: it ends no input.
    """

    name: str
    known_s: float
    within_s: float | None = PLAIN_S
    act: list[tuple[float, Callable[[Bench], None]]] = field(default_factory=list)


def _frame(flight: InputFlight, at_s: float) -> int:
    """Return the first receiver frame that begins behind an instant."""
    return int(np.ceil(at_s / flight.frame_s))


def _accepted_s(flight: InputFlight, frame: int, channel: int) -> float:
    return frame * flight.frame_s + 0.001 + 0.0023 * channel + PULSE_S


def stick(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    channel, frame = int(random.integers(0, 4)), _frame(flight, at_s)
    size = int(random.integers(52, 250))
    flight.width_us[frame:, channel] += size if random.random() < 0.5 else -size
    known_s = _accepted_s(flight, frame, channel)
    # Moved before the trigger was taken: that is its place at the trigger, and ends nothing.
    early = known_s < flight.trigger_s + TRIGGER_SLACK_S
    return Fault("stick", known_s, None if early else PLAIN_S)


def small_stick(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    channel = int(random.integers(0, 4))
    flight.width_us[_frame(flight, at_s) :, channel] += int(random.integers(-30, 31))
    return Fault("stick within its tolerance", at_s, None)


def switch(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    frame = _frame(flight, at_s)
    flight.width_us[frame:, SWITCH] = random.choice([DIRECT_US, 1450, MEGA_US, 1800, 910])
    return Fault("switch", _accepted_s(flight, frame, SWITCH))


def chatter(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    frame = _frame(flight, at_s)
    places = random.choice([DIRECT_US, MEGA_US, ARMED_US], 60)
    places[0] = DIRECT_US
    flight.width_us[frame : frame + 60, SWITCH] = places[: len(flight.width_us) - frame]
    return Fault("switch chatters", _accepted_s(flight, frame, SWITCH))


def drop_out(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    channel, frame = int(random.integers(0, 5)), _frame(flight, at_s)
    flight.width_us[frame : frame + int(random.integers(2, 40)), channel] = 0
    # Silence begins with the last pulse's rise.
    last_s = (frame - 1) * flight.frame_s + 0.001 + 0.0023 * channel
    return Fault("one channel silent", last_s + 1.5 * flight.frame_s)


def silence(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    frame = _frame(flight, at_s)
    flight.width_us[frame : frame + int(random.integers(2, 60))] = 0
    return Fault("receiver silent", (frame - 1) * flight.frame_s + 0.001 + 1.5 * flight.frame_s)


def noise(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    frame = _frame(flight, at_s)
    count = min(int(random.integers(5, 50)), len(flight.width_us) - frame)
    flight.width_us[frame : frame + count] = random.integers(700, 2300, (count, 5))
    flight.width_us[frame, :] = 1300  # the first one is believable and elsewhere
    return Fault("receiver noise", _accepted_s(flight, frame, SWITCH))


def hold(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    flight.width_us[_frame(flight, at_s) :] = flight.width_us[_frame(flight, at_s)]
    return Fault("receiver that holds", at_s, None)


def reset(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    source = int(random.choice(RESETS))
    return Fault("reset", at_s, 0.0, [(at_s, lambda bench: bench.sitl.reset(source))])


def imu_silent(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    flight.imu_sent[int(at_s / PACKET_S) + 1 :] = False
    return Fault("IMU silent", at_s + 0.030)


def imu_limit(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    packet = int(at_s / PACKET_S) + 1
    column, value = [(6, 6200), (7, -3200), (0, 21000), (1, -12500), (2, 13000), (5, 300)][
        int(random.integers(0, 6))
    ]
    flight.imu[packet:, column] = value
    return Fault("limit of the IMU", packet * PACKET_S + 0.003 + 0.002)


def imu_stuck(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    packet = int(at_s / PACKET_S) + 1
    flight.imu[packet:] = flight.imu[packet]
    return Fault("IMU stuck", packet * PACKET_S + 0.003 + 0.5 + 0.016)


def analog_limit(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    row, column = int(at_s / 0.005) + 1, int(random.choice([0, 2, 4]))
    value = float(random.choice([0.0, 100.0, 1000.0, 1023.0]))
    flight.analog[row:, column] = value
    # The value is there 5 ms later, scanned at the next frame, which takes 5 ms.
    return Fault("limit of a vane or pitot", (row + 1) * 0.005 + 0.016)


def analog_stuck(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    row, column = int(at_s / 0.005) + 1, int(random.choice([0, 2, 4]))
    flight.analog[row:, column] = 520.0 if column != 4 else 660.0
    return Fault("vane or pitot stuck", row * 0.005 + 0.016 + 0.5 + 0.016)


def height(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    row = int(at_s / 0.01) + 1
    flight.up[row:] += float(random.choice([2700.0, -6000.0]))
    return Fault("height", row * 0.01 + 0.01 + 0.085)  # asked each 40 ms, converted twice


def baro_lost(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    return Fault(
        "barometer lost", at_s + 0.150, PLAIN_S, [(at_s, lambda b: b.sitl.remove_pressure())]
    )


def gps_lost(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    flight.gps_sent[int(at_s / 0.2) + 1 :] = False
    return Fault("GPS lost", at_s + 0.2 + 0.061 + 1.0)


def far(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    epoch = int(at_s / 0.2) + 1
    flight.place[epoch:, int(random.integers(0, 2))] += int(random.choice([-1, 1])) * 80_000
    return Fault("distance", epoch * 0.2 + 0.061 + 0.050)


def button(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    flight.button.append((at_s, float(random.uniform(0.05, 3.0))))
    return Fault("button", at_s + 0.007)


def card_out(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    def act(bench: Bench) -> None:
        bench.sitl.add_card_fault(bench.sitl.now() + 20, CardFault.REMOVE)

    return Fault("card pulled", at_s + 1.0, PLAIN_S, [(at_s, act)])


def relay(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    return Fault("relay falls", at_s, RELAY_S, [(at_s, lambda bench: bench.sitl.cut_relay())])


def supply(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    # Measured once a second, and believed the third time.
    return Fault("supply low", at_s + 3.3, PLAIN_S, [(at_s, lambda b: b.sitl.set_supply(3900))])


def nothing(flight: InputFlight, at_s: float, random: np.random.Generator) -> Fault:
    return Fault("none", at_s, None)


KINDS = (
    stick, small_stick, switch, chatter, drop_out, silence, noise, hold, reset, imu_silent,
    imu_limit, imu_stuck, analog_limit, analog_stuck, height, baro_lost, gps_lost, far, button,
    card_out, relay, supply, nothing,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Flown:
    """What came of one flight."""

    fault: str
    wrong: tuple[str, ...]
    started: bool  # a deflected pulse was seen
    held: bool  # by a row that holds
    plain_s: float | None  # first plain pulse behind the instant it could be known


@cache
def _deflections(row: bytes) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return slewed(shape_of(row), cards.HEAD["rate_max_usps"])


def drawn_row(random: np.random.Generator) -> bytes:
    """Return one of the rows."""
    return (*ROWS, HELD_ROW)[int(random.integers(0, len(ROWS) + 1))]


def fly(number: int, seed: int) -> Flown:
    """Fly one drawn flight and judge it."""
    random = np.random.default_rng([seed, number])
    row = drawn_row(random)
    held = row is HELD_ROW
    shape = _deflections(row)
    row_s = QUIET_S + len(shape) / 1000
    seconds = TRIGGER_S + (TILTS_S if held else 0.0) + row_s + BEHIND_S
    fly_with = hold_flight if held else input_flight
    flight = fly_with(seconds, random, float(random.choice(FRAMES_S)))
    trigger_s = flight.trigger_s
    kind = KINDS[number % len(KINDS)]
    at_s = float(random.uniform(trigger_s - 0.1, trigger_s + row_s + 0.05))
    fault = kind(flight, at_s, random)
    bench = Bench()
    card = cards.card([row], hold=cards.HOLD if held else None)
    bench.sitl.set_eeprom(cards.eeprom_with(card))
    flight.give(bench.sitl)
    bench.sitl.power_on()
    for when_s, act in fault.act:
        bench.sitl.run_until(round(when_s * TICKS_PER_S))
        fault.known_s += bench.sitl.now() / TICKS_PER_S - when_s  # a turn of the loop, 1 ms at most
        act(bench)
    bench.sitl.run_until(round(flight.seconds * TICKS_PER_S))
    end_s = trigger_s + row_s + TRIGGER_SLACK_S + PLAIN_S
    authority = HELD_TICKS if held else (0.0, 0.0, 0.0)
    trigger = Trigger(trigger_s, end_s, QUIET_S, shape, authority)
    pulses = bench.sitl.pulses()
    wrong = wrong_pulses(pulses, flight, trigger)
    late = deflected(pulses, flight, max(trigger_s, fault.known_s))
    plain_s = None if late.size == 0 else float(late[-1]) / TICKS_PER_S + SERVO_S - fault.known_s
    if fault.within_s is not None and plain_s is not None and plain_s > fault.within_s:
        wrong.append(f"{fault.name}: plain {1000 * plain_s:.1f} ms behind")
    wrong += _relay_when_direct(bench, flight)
    return Flown(fault.name, tuple(wrong), deflected(pulses, flight, 0.0).size > 0, held, plain_s)


def _relay_when_direct(bench: Bench, flight: InputFlight) -> Iterator[str]:
    """The switch at direct for 0.2 s: the relay has let go."""
    at, level = bench.sitl.levels(Level.RELAY)
    direct = flight.width_us[:, SWITCH] == DIRECT_US
    for frame in np.flatnonzero(direct)[:-10]:
        if direct[frame : frame + 10].all():
            when = round((frame + 10) * flight.frame_s * TICKS_PER_S)
            before = np.searchsorted(at, when, side="right") - 1
            if before >= 0 and level[before]:
                yield f"the relay is engaged at {frame * flight.frame_s:.2f} s, switch at direct"
                return


def main() -> int:
    """Fly, print the table, return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--flights", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    rows: dict[str, list[Flown]] = defaultdict(list)
    bad = 0
    for number in range(options.first, options.first + options.flights):
        flown = fly(number, options.seed)
        rows[flown.fault].append(flown)
        for line in flown.wrong[:3]:
            print(f"flight {number}: {line}", file=sys.stderr)
        bad += bool(flown.wrong)
    print("| fault | flights | input begun | first plain pulse behind it, ms | wrong |")
    print("| --- | --- | --- | --- | --- |")
    for name, flights in sorted(rows.items()):
        last = max((f.plain_s for f in flights if f.plain_s is not None), default=None)
        said = "-" if last is None else f"{1000 * last:.1f}"
        begun = sum(f.started for f in flights)
        wrong = sum(bool(f.wrong) for f in flights)
        print(f"| {name} | {len(flights)} | {begun} | {said} | {wrong} |")
    held = [f for flights in rows.values() for f in flights if f.held]
    begun, wrong = sum(f.started for f in held), sum(bool(f.wrong) for f in held)
    print(f"rows that hold: {len(held)} flights, {begun} begun, {wrong} wrong")
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
