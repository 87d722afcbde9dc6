"""A flight whose row holds axes: the recorder and an aircraft in one loop.

The ground, the pilot and every sensor but the IMU are those of `input_flight`; behind the enabling
sign the pilot tilts the aircraft and gives stick against it. From `LAUNCH_S` on the IMU's packets
come from an aircraft that flies by the recorder's own servo pulses.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TypeVar

import numpy as np
from host.aircraft.air import (
    GUST_STATES,
    Air,
    Atmosphere,
    Turbulence,
    atmosphere,
    density_kgpm3,
    gust_step,
    turbulence,
)
from host.aircraft.airframe import (
    AILERON as AILERON_STATE,
)
from host.aircraft.airframe import (
    ELEVATOR as ELEVATOR_STATE,
)
from host.aircraft.airframe import (
    Q0,
    RUDDER,
    STATE_COUNT,
    Airframe,
    P,
)
from host.aircraft.attitude import quaternion
from host.aircraft.file import load
from host.aircraft.rigid_body import step
from host.aircraft.trim import Trim, solve
from host.compiled import compiled_fast
from host.twin.flight.stick_commands import THROW_US
from host.twin.recorder.sitl_library import TICKS_PER_S
from host.wire.packets import packet
from numpy.typing import NDArray

from tests.sitl.bench import Bench
from tests.sitl.input_flight import (
    AILERON,
    ELEVATOR,
    LEAST_US,
    MOST_US,
    PACKET_S,
    SIGN_S,
    InputFlight,
    input_flight,
)
from tests.sitl.input_flight import TRIGGER_S as WITHOUT_TILT_S
from tests.sitl.script import IMU, IMU_ADDRESS, IMU_FLAGS

Array = NDArray[np.float64]
Scalar = TypeVar("Scalar", bound=np.generic)

TILT_AT_S, TILTS_S = SIGN_S + 3.7, 8.0  # put in behind the sign
ROLLED_S, PITCHED_S, SHOWN_S = TILT_AT_S + 0.2, TILT_AT_S + 4.2, 3.5
TILT = 3000  # 30 deg
TRIGGER_S = WITHOUT_TILT_S + TILTS_S
LAUNCH_S = TRIGGER_S - 1.5
AIRSPEED_MPS, HEIGHT_M = 17.0, 75.0
STEP_S = 1e-3
RATE_STEP, FORCE_STEP, ANGLE_STEP = 2.664624812204e-4, 1.197100830078e-3, 1.745329251994e-4
NEUTRAL_US = 1500.0
SURFACES = (AILERON_STATE, ELEVATOR_STATE, RUDDER)
SEEN_PULSES = 40  # of four servos: 0.2 s
PAST_STEPS = 1  # packets: what the gyro's low-pass of 42 Hz makes old


@dataclass(slots=True)
class World:
    """What the flight is drawn with.

    Attributes
    ----------
    frame : Airframe
        As it really is.
    turbulence_mps : float
    gain : (3,) array
        Gains of aileron, elevator, rudder: angle for what was commanded.
    offset_rad : (3,) array
        Offsets of the surfaces from the trim.
    bank_rad, pitch_rad : float
        At launch, besides the trim's.
    seed : int
        Seed of the air.
    imu : callable
        (time in s, row of the packet's nine values) to the row that is sent; None: nothing is.
    """

    frame: Airframe
    turbulence_mps: float = 0.0
    gain: Array = field(default_factory=lambda: np.ones(3))
    offset_rad: Array = field(default_factory=lambda: np.zeros(3))
    bank_rad: float = 0.0
    pitch_rad: float = 0.0
    seed: int = 0
    imu: Callable[[float, NDArray[np.int64]], NDArray[np.int64] | None] = lambda _, row: row


@dataclass(frozen=True, slots=True)
class Motion:
    """True motion from `LAUNCH_S` on, a row each packet.

    Attributes
    ----------
    t_s, bank_rad, pitch_rad : (n,) arrays
    surface_rad : (n, 3) array
        Aileron, elevator, rudder.
    """

    t_s: Array
    bank_rad: Array
    pitch_rad: Array
    surface_rad: Array


def hold_flight(
    seconds: float, random: np.random.Generator, frame_s: float = 0.02, *, tilted: bool = True
) -> InputFlight:
    """Return `input_flight` with the tilts of the ground, or with as long a rest in their place."""
    flight = input_flight(seconds - TILTS_S, random, frame_s)

    def longer(values: NDArray[Scalar], period_s: float) -> NDArray[Scalar]:
        at, count = round(TILT_AT_S / period_s), round(TILTS_S / period_s)
        # The same 0.2 s again and again: noise and all.
        piece = values[at - round(0.2 / period_s) : at]
        rest = np.resize(piece, (count, *values.shape[1:]))
        return np.concatenate([values[:at], rest, values[at:]])

    flight.width_us = longer(flight.width_us, frame_s)
    flight.imu, flight.imu_sent = longer(flight.imu, PACKET_S), longer(flight.imu_sent, PACKET_S)
    flight.analog, flight.up = longer(flight.analog, 0.005), longer(flight.up, 0.01)
    flight.place, flight.gps_sent = longer(flight.place, 0.2), longer(flight.gps_sent, 0.2)
    flight.ground_speed_cmps = longer(flight.ground_speed_cmps, 0.2)
    trigger_s = WITHOUT_TILT_S + round(TILTS_S / frame_s) * frame_s
    flight = replace(flight, seconds=seconds, trigger_s=trigger_s)
    if tilted:
        for begin_s, channel, us, column in (
            (ROLLED_S, AILERON, LEAST_US, 6),
            (PITCHED_S, ELEVATOR, MOST_US, 7),
        ):
            frames = slice(round(begin_s / frame_s), round((begin_s + SHOWN_S) / frame_s))
            flight.width_us[frames, channel] = us
            packets = slice(round(begin_s / PACKET_S), round((begin_s + SHOWN_S) / PACKET_S))
            flight.imu[packets, column] = TILT
    return flight


def drawn_world(random: np.random.Generator, turbulence_mps: float) -> World:
    """Return a world as far from the model as the campaign asks."""
    frame = load("ultrastick25e").airframe()
    cg = frame.cg_m + np.array([random.uniform(-0.03, 0.03) * frame.chord_m, 0.0, 0.0])
    slow = 0.5 if random.random() < 0.5 else 1.0
    frame = frame._replace(
        cg_m=cg,
        servo_bandwidth_radps=slow * frame.servo_bandwidth_radps,
        servo_rate_radps=slow * frame.servo_rate_radps,
    )
    return World(
        frame,
        turbulence_mps,
        gain=np.exp(random.uniform(math.log(0.5), math.log(2.0), 3)),
        offset_rad=np.radians(random.uniform(-0.5, 0.5, 3)),
        bank_rad=math.radians(random.uniform(-10.0, 10.0)),
        pitch_rad=math.radians(random.uniform(-3.0, 3.0)),
        seed=int(random.integers(1 << 31)),
    )


@compiled_fast
def _advance(
    frame: Airframe,
    air: Turbulence,
    density: float,
    noise: Array,
    command: Array,
    x: Array,
    z: Array,
    now: Array,
    work: Array,
) -> None:
    for i in range(noise.shape[0]):
        speed = math.sqrt((x[0] - now[3]) ** 2 + (x[1] - now[4]) ** 2 + (x[2] - now[5]) ** 2)
        if air.sigma_w_mps > 0.0:
            gust_step(air, z, noise[i], speed, frame.span_m, STEP_S, now[3:])
        step(frame, x, command, now, density, STEP_S, work)


def fly_closed(
    bench: Bench,
    flight: InputFlight,
    world: World,
    acts: list[tuple[float, Callable[[Bench], None]]] | None = None,
) -> Motion:
    """Fly: the bench is on, its EEPROM has the card; `acts` are called at their times."""
    packets_before = round(LAUNCH_S / PACKET_S)
    sent = flight.imu_sent
    replace(flight, imu_sent=sent & (np.arange(len(sent)) < packets_before)).give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(round((LAUNCH_S - 0.003) * TICKS_PER_S))

    density, trim = _trimmed()
    gusts = turbulence(Air(turbulence_mps=world.turbulence_mps), HEIGHT_M)
    random = np.random.default_rng([world.seed, 7])
    x, z, now = trim.state.copy(), np.zeros(GUST_STATES), np.zeros(9)
    alpha = math.atan2(x[2], x[0])
    x[Q0 : Q0 + 4] = quaternion(world.bank_rad, alpha + world.pitch_rad, 0.0)
    work = np.empty((5, STATE_COUNT + 4))
    command = trim.command.copy()
    per_us = world.gain * world.frame.surface_limit_rad[[1, 0, 2]] / THROW_US
    waiting = list(acts or [])
    rows: list[list[float]] = []
    past: list[NDArray[np.int64]] = []
    count = round((flight.seconds - LAUNCH_S) / PACKET_S) - 4
    for n in range(count):
        at_s = LAUNCH_S + n * PACKET_S
        start, output, width = (each[-SEEN_PULSES:] for each in bench.sitl.pulses())
        ended = start + width <= bench.sitl.now()
        newest = dict(zip(output[ended].tolist(), width[ended].tolist(), strict=True))
        for axis, surface in ((0, 1), (1, 0), (2, 2)):
            if axis in newest:
                us = 0.5 * newest[axis] - NEUTRAL_US
                command[surface] = trim.command[surface] + world.offset_rad[axis]
                command[surface] += per_us[axis] * us
        noise = random.standard_normal((5, 4))
        _advance(world.frame, gusts, density, noise, command, x, z, now, work)
        q = x[Q0 : Q0 + 4]
        bank = math.atan2(2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] ** 2 + q[2] ** 2))
        pitch = math.asin(min(max(2 * (q[0] * q[2] - q[1] * q[3]), -1.0), 1.0))
        rows.append([at_s, bank, pitch, *x[list(SURFACES)]])
        rates = x[P : P + 3] / RATE_STEP
        force = work[0, STATE_COUNT : STATE_COUNT + 3] / FORCE_STEP
        raw = np.concatenate([rates, force, np.array([bank, pitch, 0.0]) / ANGLE_STEP])
        raw[:3] += random.normal(0.0, 4.0, 3)
        raw[3:6] += random.normal(0.0, 20.0, 3)
        past.append(np.clip(np.round(raw), -32767, 32767).astype(np.int64))
        seen = past[max(0, len(past) - 1 - PAST_STEPS)]
        number = packets_before + n
        given = world.imu(at_s, seen.copy())
        if given is not None and (number >= len(sent) or sent[number]):
            _send(bench, number, given)
        bench.sitl.run_until(round((at_s + PACKET_S - 0.002) * TICKS_PER_S))
        while waiting and waiting[0][0] <= at_s:
            waiting.pop(0)[1](bench)
    table = np.array(rows)
    return Motion(table[:, 0], table[:, 1], table[:, 2], table[:, 3:6])


@cache
def _trimmed() -> tuple[float, Trim]:
    field_air: Atmosphere = atmosphere(101_325.0, 15.0)
    density = density_kgpm3(field_air, HEIGHT_M)
    nominal = load("ultrastick25e").airframe()
    return density, solve(nominal, AIRSPEED_MPS, density_kgpm3=density)


@cache
def _packet_row() -> NDArray[np.void]:
    rows = packet("imu").rows(1)
    rows["flags"], rows["age"] = IMU_FLAGS, 225
    return rows


def _send(bench: Bench, number: int, values: NDArray[np.int64]) -> None:
    start = np.array([round((number * PACKET_S + 0.004) * TICKS_PER_S)])
    rows = _packet_row().copy()
    rows["seq"], rows["t_us"] = number & 0xFF, (start // 2) & 0xFFFFFFFF
    for column, name in enumerate(IMU):
        rows[name] = values[column]
    bench.sitl.add_packets(start, IMU_ADDRESS, packet("imu").sealed(rows))
