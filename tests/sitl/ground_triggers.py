"""Triggers on the ground, of which none may start a row, and honest ones in flight.

    python tests/sitl/ground_triggers.py --ground 340 --honest 180

Every draw is a session: the pilot shows the travel, gives the sign, puts the throttle up and
triggers thirty times. On the ground up to two of the causes below act, with the loosest card that
the logger takes. In flight the aircraft is known by its pitot, its GPS or both. The log's events
are counted, and every servo pulse is compared with the sticks.
Prints two tables; 6 if a row started on the ground or too many honest triggers were refused.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from host.twin.recorder.sitl_library import TICKS_PER_S
from host.wire.schema_text import packed_schema

from tests.sitl import flight_cards as cards
from tests.sitl.bench import Bench
from tests.sitl.input_flight import (
    AILERON,
    ANALOG_S,
    ARMED_US,
    BAROMETER_NOISE_PA,
    DIRECT_US,
    ELEVATOR,
    FRAME_S,
    GPS_S,
    HOME,
    IDLE_US,
    LEAST_US,
    MEGA_US,
    MOST_US,
    PACKET_S,
    PASCAL_UP,
    PRESSURE_S,
    RUDDER,
    STILL_UP,
    SWITCH,
    THROTTLE,
    InputFlight,
)
from tests.sitl.input_judge import deflected

Array = NDArray[np.float64]
SEED = 46_100
TRIGGERS = 30
CYCLE_S, AT_MEGA_S = 1.4, 0.75
STILL_S, SHOW_S, SIGN_S, SETTLE_S = 20.0, 4.0, 3.6, 5.0
SIGNED_S = STILL_S + SHOW_S + SIGN_S  # the card is enabled
BEGIN_S = SIGNED_S + SETTLE_S  # first trigger
SECONDS = BEGIN_S + TRIGGERS * CYCLE_S + 1.0
COUNT_PA = 4.88  # of one conversion
HALF_DENSITY = 0.6125
MOST_REFUSED = 0.001
PRESSURE_A_METRE = 12.0
ROW = cards.row(shape=cards.PULSE, axes=2, quiet_ms=100, duration_ms=100, amplitude_us=(0, 100, 0))
# Whatever the logger takes: only the proof of flight and the height stand between card and ground.
LOOSE = {
    "dp_min": 0, "dp_max": 4092, "alpha_input": 255, "beta_input": 255, "phi_max": 18_000,
    "theta_min": -32_768, "theta_max": 32_767, "p_max": 32_767, "q_max": 32_767, "r_max": 32_767,
    "az_min": -32_768, "az_max": 32_767, "height_min_pa": 120, "height_max_pa": 65_535,
    "still_ms": 2000, "stick_us": 200,
}  # fmt: skip
EVENTS = packed_schema().enums["event"]
WHY = {value: name for name, value in packed_schema().enums["input_end"].items()}


@dataclass(slots=True)
class World:
    """What surrounds the instrument, each on its own grid from power-on.

    Attributes
    ----------
    pressure_pa, air_mps, ground_mps : arrays
        Change of the static pressure; air at the pitots; speed over ground.
    shake, turned : arrays
        Motion of the IMU: half-width of its noise in LSB; attitude, 0.01 deg.
    throttle_us : array
        Pulses of the stick, frame by frame of the receiver.
    frozen_from_s : float
        The barometer repeats itself from here on.
    """

    random: np.random.Generator
    pressure_s: Array = field(default_factory=lambda: np.arange(0.0, SECONDS + 0.1, PRESSURE_S))
    air_s: Array = field(default_factory=lambda: np.arange(0.0, SECONDS + 0.1, ANALOG_S))
    ground_s: Array = field(default_factory=lambda: np.arange(0.0, SECONDS - 0.2, GPS_S))
    imu_s: Array = field(default_factory=lambda: np.arange(0.0, SECONDS - 0.05, PACKET_S))
    pressure_pa: Array = field(init=False)
    air_mps: Array = field(init=False)
    ground_mps: Array = field(init=False)
    shake: Array = field(init=False)
    turned: Array = field(init=False)
    throttle_us: Array = field(init=False)
    frozen_from_s: float = np.inf

    def __post_init__(self) -> None:
        """Begin with a calm day."""
        self.pressure_pa = np.zeros(len(self.pressure_s))
        self.air_mps = np.zeros(len(self.air_s))
        self.ground_mps = np.abs(self.random.normal(0.0, 0.1, len(self.ground_s)))
        self.shake = np.full(len(self.imu_s), 8.0)
        self.turned = np.zeros(len(self.imu_s))
        self.throttle_us = np.full(round(SECONDS / FRAME_S), 1400.0)


def behind(at_s: Array, from_s: float) -> Array:
    """Return 0 before and 1 from an instant on."""
    return (at_s >= from_s).astype(np.float64)


def drifting(random: np.random.Generator, at_s: Array, within_s: float) -> Array:
    """Return noise of unit variance with a correlation time, linear between knots."""
    knots = np.arange(at_s[0], at_s[-1] + within_s, within_s)
    return np.interp(at_s, knots, random.normal(0.0, 1.0, len(knots)))


def wind(world: World) -> None:
    """At the pitots up to 12 m/s, steady or in gusts, from before the sign on."""
    random = world.random
    mean = float(random.uniform(6.0, 12.0))
    gusts = float(random.choice([0.0, 0.1, 0.3]))
    blown = mean * (1.0 + gusts * drifting(random, world.air_s, 1.5))
    # It may rise only behind the sign, when the pitots' zero is taken.
    early = float(random.choice([0.0, 0.5, 1.0]))
    blown *= np.where(world.air_s < SIGNED_S, early, 1.0)
    world.air_mps = np.maximum(world.air_mps, np.clip(blown, 0.0, 12.0))


def static_port(world: World) -> None:
    """Wrong by up to 150 Pa."""
    wrong = 150.0 * float(world.random.choice([1.0, world.random.uniform(0.0, 1.0), -1.0]))
    world.pressure_pa -= wrong * behind(world.pressure_s, SIGNED_S + 1.0)


def front(world: World) -> None:
    """Sink 300 Pa an hour for up to twenty minutes, which pass in the session."""
    fallen = 100.0 * float(world.random.uniform(0.5, 1.0))
    world.pressure_pa -= fallen * np.clip((world.pressure_s - SIGNED_S) / SETTLE_S, 0.0, 1.0)


def door(world: World) -> None:
    """Shut, or left open: 100 Pa for a moment, again and again."""
    at = SIGNED_S + 1.0
    while at < SECONDS:
        held = float(world.random.uniform(0.1, 4.0))
        inside = (world.pressure_s >= at) & (world.pressure_s < at + held)
        world.pressure_pa[inside] += 100.0 * float(world.random.choice([-1.0, -1.0, 1.0]))
        at += held + float(world.random.uniform(0.2, 3.0))


def barometer_wrong(world: World) -> None:
    """By up to 2000 Pa, at once or slowly."""
    wrong = float(world.random.uniform(120.0, 2000.0)) * float(world.random.choice([1, 1, 1, -1]))
    slow_s = float(world.random.choice([0.01, 2.0, 20.0]))
    begun = np.clip((world.pressure_s - SIGNED_S - 1.0) / slow_s, 0.0, 1.0)
    world.pressure_pa -= wrong * begun


def barometer_stuck(world: World) -> None:
    """Repeat one value."""
    world.frozen_from_s = SIGNED_S + float(world.random.uniform(0.0, 10.0))


def gps_wanders(world: World) -> None:
    """At up to 8 m/s for 2 s, again and again."""
    at = SIGNED_S + 1.0
    while at < SECONDS:
        fast = (world.ground_s >= at) & (world.ground_s < at + 2.0)
        world.ground_mps[fast] = float(world.random.uniform(4.0, 8.0))
        at += 2.0 + float(world.random.uniform(0.3, 4.0))


def engine(world: World) -> None:
    """From idle to full and back: vibration, and pressure in the slipstream."""
    share = np.abs(drifting(world.random, world.imu_s, 3.0)).clip(0.0, 1.0)
    share *= behind(world.imu_s, SIGNED_S + 1.0)
    world.shake = np.maximum(world.shake, 8.0 + 16_000.0 * share)
    frames = np.arange(len(world.throttle_us)) * FRAME_S
    world.throttle_us = 1150.0 + 750.0 * np.interp(frames, world.imu_s, share)
    world.pressure_pa -= 7.0 * np.interp(world.pressure_s, world.imu_s, share)


def hand(world: World) -> None:
    """Carried about and up a slope of 3 m, at the speed of a run."""
    random, up = world.random, behind(world.pressure_s, SIGNED_S)
    climbed = 3.0 * np.abs(drifting(random, world.pressure_s, 5.0)).clip(0.0, 1.0)
    world.pressure_pa -= PRESSURE_A_METRE * climbed * up
    run = 4.0 * np.abs(drifting(random, world.ground_s, 3.0)).clip(0.0, 1.0)
    world.ground_mps = np.maximum(world.ground_mps, run * behind(world.ground_s, SIGNED_S))
    moved = np.interp(world.air_s, world.ground_s, world.ground_mps)
    world.air_mps = np.maximum(world.air_mps, moved)
    world.turned = 3000.0 * drifting(random, world.imu_s, 0.7) * behind(world.imu_s, SIGNED_S)
    world.shake = np.maximum(world.shake, 800.0)


def car(world: World) -> None:
    """Driven on a level road at up to 20 m/s."""
    speed = 20.0 * float(world.random.uniform(0.3, 1.0))
    driven = speed * np.clip((world.ground_s - SIGNED_S) / SETTLE_S, 0.0, 1.0)
    world.ground_mps = np.maximum(world.ground_mps, driven)
    there = speed * np.clip((world.air_s - SIGNED_S) / SETTLE_S, 0.0, 1.0)
    world.air_mps = np.maximum(world.air_mps, there)
    world.shake = np.maximum(world.shake, 500.0)
    world.pressure_pa += 3.0 * drifting(world.random, world.pressure_s, 4.0).clip(-1.5, 1.5)


CAUSES: tuple[Callable[[World], None], ...] = (
    wind, static_port, front, door, barometer_wrong, barometer_stuck, gps_wanders, engine, hand,
    car,
)  # fmt: skip
# Real speed together with a barometer that is wrong: nothing here can tell it from flying.
POSSIBLE = ({car, static_port}, {car, barometer_wrong})
ACTING = tuple(
    acting
    for size in (1, 2)
    for acting in combinations(CAUSES, size)
    if set(acting) not in POSSIBLE
)


def flight_of(world: World, *, gps: bool) -> InputFlight:
    """Return what reaches the pins in a world; the pilot triggers thirty times."""
    random = world.random
    at = np.arange(round(SECONDS / FRAME_S)) * FRAME_S
    width_us = np.full((len(at), 5), 1500, dtype=np.int64)
    shown = (at >= STILL_S) & (at < STILL_S + SHOW_S)
    phase = np.floor((at - STILL_S) / (SHOW_S / 4)).astype(int)
    for channel in (AILERON, ELEVATOR, RUDDER):
        width_us[shown & (phase == 0), channel] = LEAST_US
        width_us[shown & (phase == 2), channel] = MOST_US
    sign = (at >= STILL_S + SHOW_S) & (at < SIGNED_S)
    width_us[sign, AILERON], width_us[sign, RUDDER] = MOST_US, LEAST_US
    width_us[:, THROTTLE] = np.where(at < SIGNED_S + 0.5, IDLE_US, world.throttle_us)
    in_cycle = np.mod(at - BEGIN_S, CYCLE_S)
    switch = np.where(in_cycle < AT_MEGA_S, MEGA_US, ARMED_US)
    width_us[:, SWITCH] = np.where(at < BEGIN_S, np.where(at < BEGIN_S - 1.0, DIRECT_US, MEGA_US),
                                   switch)  # fmt: skip

    imu = np.zeros((len(world.imu_s), 9), dtype=np.int64)
    shake = random.uniform(-1.0, 1.0, (len(imu), 6)) * world.shake[:, None]
    imu[:, :6] = np.round(shake).astype(np.int64)
    imu[:, 5] -= 8192
    imu[:, 6] = imu[:, 7] = np.round(world.turned)
    imu[:, :3] = np.clip(imu[:, :3], -1500, 1500)

    analog = 512.0 + random.normal(0.0, 0.7, (len(world.air_s), 11))
    analog[:, 4:6] += (HALF_DENSITY * world.air_mps**2 / COUNT_PA)[:, None]
    pa = world.pressure_pa + random.normal(0.0, BAROMETER_NOISE_PA, len(world.pressure_s))
    up = STILL_UP + PASCAL_UP * pa
    frozen = world.pressure_s >= world.frozen_from_s
    up[frozen] = up[np.argmax(frozen)] if frozen.any() else 0.0

    gone_m = np.cumsum(world.ground_mps) * GPS_S
    around = np.stack([np.sin(gone_m / 100.0), 1.0 - np.cos(gone_m / 100.0)], axis=1)
    place = np.array(HOME) + np.round(100.0 * around / [0.0111, 0.0101]).astype(np.int64)
    return InputFlight(
        SECONDS, width_us, imu, np.ones(len(imu), dtype=np.bool_), analog, up,
        place.astype(np.int64), np.full(len(place), gps),
        ground_speed_cmps=np.round(100.0 * world.ground_mps).astype(np.int64),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Session:
    """A flight on its way to the recorder, and what is drawn about it."""

    name: str
    flight: InputFlight
    card: bytes


def on_the_ground(number: int, seed: int = SEED, acting: tuple[Callable[[World], None], ...] = ()
                  ) -> Session:  # fmt: skip
    """Draw a session on the ground; `acting` in place of the one that is its turn."""
    random = np.random.default_rng([seed, 0, number])
    causes = acting or ACTING[number % len(ACTING)]
    world = World(random)
    for cause in causes:
        cause(world)
    gps = bool(random.random() < 0.6)
    watched = int(random.choice([4, 5, 255]))
    distance_m = int(random.choice([0, 3000])) if gps else 0
    card = cards.card(
        [ROW], (), (), **LOOSE | {"airspeed_input": watched, "distance_max_m": distance_m}
    )
    name = " and ".join(cause.__name__.replace("_", " ") for cause in causes)
    return Session(name, flight_of(world, gps=gps), card)


KNOWN_BY = ("pitot", "GPS", "both")


def in_flight(number: int, seed: int = SEED) -> Session:
    """Draw an honest session: an aircraft that flies its rows well above its least airspeed."""
    random = np.random.default_rng([seed, 1, number])
    known_by = KNOWN_BY[number % len(KNOWN_BY)]
    world = World(random)
    speed = float(random.uniform(17.0, 25.0))
    gust_mps = float(random.uniform(0.0, 1.0))
    wind_mps = float(random.uniform(0.0, 0.5 * speed))  # ground speed is half of it at least
    away_s = SIGNED_S + 0.5
    off = np.clip((world.air_s - away_s) / 1.5, 0.0, 1.0)
    world.air_mps = np.where(
        world.air_s < away_s,
        random.uniform(0.0, 5.0),
        off * (speed + gust_mps * drifting(random, world.air_s, 0.5)),
    )
    over_ground = speed + wind_mps * np.cos(0.15 * (world.ground_s - away_s))
    world.ground_mps += np.clip((world.ground_s - away_s) / 1.5, 0.0, 1.0) * over_ground
    high_pa = float(random.uniform(200.0, 1500.0))
    world.pressure_pa -= high_pa * np.clip((world.pressure_s - away_s) / (SETTLE_S - 1.0), 0.0, 1.0)
    world.pressure_pa += 6.0 * drifting(random, world.pressure_s, 2.0)
    world.turned = 400.0 * drifting(random, world.imu_s, 0.5) * behind(world.imu_s, away_s)
    world.shake = np.where(world.imu_s < away_s, 8.0, 600.0)
    least_pa = HALF_DENSITY * (0.7 * speed) ** 2
    card = cards.card(
        [ROW],
        (),
        (),
        **LOOSE
        | {
            "airspeed_input": 255 if known_by == "GPS" else 4,
            "dp_min": 2048 + round(4 * least_pa / COUNT_PA),
            "still_ms": 500,
            "distance_max_m": 0 if known_by == "pitot" else 3000,
        },
    )
    return Session(known_by, flight_of(world, gps=known_by != "pitot"), card)


@dataclass(frozen=True, slots=True)
class Told:
    """What a session's log and pulses say."""

    enabled: bool
    started: int
    refused: Counter[str]
    moved: int  # servo pulses that were not the pilot's


def told_by(rows: NDArray[np.void], moved: int) -> Told:
    """Return what the rows of frame `event` say."""
    code, arg = rows["code"], rows["arg"]
    reasons = arg[code == EVENTS["input_refused"]] >> 8 & 0xFF
    return Told(
        enabled=bool((code == EVENTS["card_enabled"]).any()),
        started=int((code == EVENTS["input_start"]).sum()),
        refused=Counter(WHY[int(why)] for why in reasons),
        moved=moved,
    )


def fly(session: Session) -> Told:
    """Fly it on this computer."""
    bench = Bench()
    bench.sitl.set_eeprom(cards.eeprom_with(session.card))
    session.flight.give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(round(SECONDS * TICKS_PER_S))
    moved = int(deflected(bench.sitl.pulses(), session.flight, 0.0).size)
    with tempfile.TemporaryDirectory() as folder:
        return told_by(bench.log(Path(folder)).frames["event"], moved)


def reasons(refused: Counter[str]) -> str:
    """Return why triggers were refused, the most frequent first."""
    return ", ".join(f"{name} {count}" for name, count in refused.most_common()) or "-"


def ground_table(count: int, seed: int = SEED) -> int:
    """Print the table of the ground; return the number of what must not be."""
    total, started, moved, refused = 0, 0, 0, Counter[str]()
    bad: list[str] = []
    for number in range(count):
        session = on_the_ground(number, seed)
        told = fly(session)
        if not told.enabled or sum(told.refused.values()) + told.started != TRIGGERS:
            bad.append(f"session {number}, {session.name}: {told}: not {TRIGGERS} triggers")
        total += TRIGGERS
        started += told.started
        moved += told.moved
        refused += told.refused
        if told.started or told.moved:
            bad.append(f"session {number}, {session.name}: {told.started} rows started")
    for line in bad[:20]:
        print(line, file=sys.stderr)
    print("| triggers on the ground | rows started | pulses moved | refused because of |")
    print("| --- | --- | --- | --- |")
    print(f"| {total} | {started} | {moved} | {reasons(refused)} |")
    return len(bad)


def possible_table(count: int, seed: int = SEED) -> None:
    """Print what stays possible: real speed with a barometer that is wrong."""
    for pair in POSSIBLE:
        acting = tuple(cause for cause in CAUSES if cause in pair)
        told = [fly(on_the_ground(1_000_000 + n, seed, acting)) for n in range(count)]
        name = " and ".join(cause.__name__.replace("_", " ") for cause in acting)
        print(f"| stays possible: {name} | {count * TRIGGERS} |"
              f" {sum(one.started for one in told)} started |")  # fmt: skip


def honest_table(count: int, seed: int = SEED) -> int:
    """Print the table of the honest flights; return how many ways miss the limit."""
    flown: dict[str, list[Told]] = {name: [] for name in KNOWN_BY}
    for number in range(count):
        session = in_flight(number, seed)
        told = fly(session)
        if not told.enabled:
            print(f"session {number}, {session.name}: not enabled", file=sys.stderr)
        flown[session.name].append(told)
    print("| flight known by | triggers | not started | refused because of |")
    print("| --- | --- | --- | --- |")
    missed = 0
    for name, each in flown.items():
        triggers = len(each) * TRIGGERS
        idle = triggers - sum(one.started for one in each)
        why = sum((one.refused for one in each), Counter[str]())
        missed += idle > MOST_REFUSED * triggers
        print(f"| {name} | {triggers} | {idle} | {reasons(why)} |")
    return missed


def main() -> int:
    """Draw, fly, print; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--ground", type=int, default=340, metavar="SESSIONS")
    parser.add_argument("--honest", type=int, default=180, metavar="SESSIONS")
    parser.add_argument("--possible", type=int, default=10, metavar="SESSIONS")
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    bad = ground_table(options.ground, options.seed)
    possible_table(options.possible, options.seed)
    bad += honest_table(options.honest, options.seed)
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
