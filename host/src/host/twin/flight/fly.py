"""One flight: pilot, radio, aircraft and air, integrated together at 1 kHz."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from host.aircraft import air as air_model
from host.aircraft.air import GUST_STATES, Atmosphere, Turbulence, density_kgpm3, gust_step
from host.aircraft.airframe import (
    DOWN,
    EAST,
    NORTH,
    Q0,
    Q1,
    Q2,
    Q3,
    ROTOR,
    STATE_COUNT,
    Airframe,
    Array,
    P,
)
from host.aircraft.attitude import multiply, quaternion
from host.aircraft.file import Aircraft, AircraftError
from host.aircraft.linear_aircraft import load
from host.aircraft.rigid_body import rotate_to_body, rotate_to_ned, step
from host.aircraft.trim import Trim, solve
from host.compiled import compiled_fast
from host.instrument.instrument_errors import InstrumentErrors
from host.twin.flight.draws import GROUPS, Draws, draw, true_airframe
from host.twin.flight.pilot import NOWHERE_M, SWITCH_DIRECT_US, Schedule, gains, schedule
from host.twin.testcard.cards import Card

STEP_S = 1e-3
RC_PERIOD_S = 0.020
RC_CHANNELS = 5  # aileron, elevator, rudder, throttle, switch
# Futaba: neutral 1520 us, +-400 us full throw.
NEUTRAL_US = 1520.0
THROW_US = 400.0
IDLE_US = 1120.0
STEER_RAD = 0.35  # bank with which the pilot turns towards the aim
GAP_US = 300.0  # between the pulses of a sequential receiver
JITTER_US = 1.0  # rms of a receiver's width
LINK_OK, LINK_LOST, LINK_PRESET = 0, 1, 2  # state of the radio in one receiver frame


class Hands(NamedTuple):
    """Numbers of pilot, radio and servos that the kernel needs."""

    bank_gain: float
    pitch_gain: float
    height_gain_radpm: float
    speed_gain_smpm: float
    delay_steps: int
    remnant_rad: float
    jitter_us: float
    period_steps: int
    ground_steps: int
    cut_step: int
    height_m: float
    servo_gain: Array  # elevator, aileron, rudder: real deflection over commanded deflection
    servo_zero_rad: Array
    servo_late_us: float


@dataclass(frozen=True, slots=True)
class FlightRecord:
    """What really happened, on the grid `t_s` (n,), 1 kHz. It ends at the card's end, or where the
    ground is touched: there is no model of a landing.

    Attributes
    ----------
    t_s : (n,) array
        True time since power-on.
    states : (n, 17) array
        `airframe.STATES`.
    specific_force_mps2, angular_acceleration_radps2 : (n, 3) arrays
        At the CG, body axes.
    thrust_n, density_kgpm3 : (n,) arrays
    air : (n, 9) array
        Wind north, east, down, gust u v w p q r (motion of the air).
    pulses_us : (frames, 5) array
        Widths the receiver puts out: aileron, elevator, rudder, throttle, switch.
    pulse_starts_s : (frames,) array
        Start of each receiver frame.
    card, aircraft, seed, draws, frame, trim, schedule
        What was flown; `frame` is the aircraft as it really was.
    """

    card: Card
    aircraft: Aircraft
    seed: int
    draws: Draws
    frame: Airframe
    trim: Trim
    schedule: Schedule
    atmosphere: Atmosphere
    t_s: Array
    states: Array
    specific_force_mps2: Array
    angular_acceleration_radps2: Array
    thrust_n: Array
    density_kgpm3: Array
    air: Array
    pulses_us: Array
    pulse_starts_s: Array

    @property
    def touched_ground(self) -> bool:
        """Whether the flight ended on the ground before the card was through."""
        return len(self.t_s) < len(self.schedule.attention)

    @property
    def sink_mps(self) -> float:
        """Vertical speed at the last sample, downwards."""
        return float(rotate_to_ned(self.states[-1], *self.states[-1, :3])[2])


@compiled_fast
def fly_steps(
    frame: Airframe,
    hands: Hands,
    atmosphere: Atmosphere,
    turbulence: Turbulence,
    launch: Array,
    rest: Array,
    trimmed: Array,
    program: Array,
    link: NDArray[np.int64],
    preset_us: Array,
    attention: Array,
    bank_rad: Array,
    airspeed_mps: Array,
    switch_us: Array,
    added_us: Array,
    aim_m: Array,
    wind: Array,
    noise: Array,
    stick_noise: Array,
    step_s: float,
    first: int,
    last: int,
    x: Array,
    z: Array,
    held: Array,
    command: Array,
    states: Array,
    more: Array,
    air: Array,
    pulses: Array,
) -> int:
    """Integrate steps first..last; return how many were flown before the ground was touched.

    `more` (n, 8) takes specific force, angular acceleration, thrust, density; `held` (9,) keeps the
    stick (4), its wander (4) and the commands between frames; `added_us` (n, 3) or (0, 3) is what
    the logger adds to aileron, elevator, rudder; `link` (frames,) says how the radio does,
    `preset_us` (5,) what the receiver puts out without it; the rest is as in `FlightRecord`.
    """
    work = np.empty((5, STATE_COUNT + 4))
    now = np.zeros(9)
    limit = frame.surface_limit_rad
    for i in range(first, last):
        if i == hands.ground_steps:
            x[:] = launch
            command[:] = trimmed
        flying = i >= hands.ground_steps
        if flying and x[DOWN] > 0.0:
            return i
        rho = density_kgpm3(atmosphere, -x[DOWN])
        for k in range(3):
            now[k] = wind[k]
        wu, wv, ww = rotate_to_body(x, wind[0], wind[1], wind[2])
        ua, va, wa = x[0] - wu - now[3], x[1] - wv - now[4], x[2] - ww - now[5]
        speed = math.sqrt(ua * ua + va * va + wa * wa)
        if turbulence.sigma_w_mps > 0.0 and flying:
            gust_step(turbulence, z, noise[i], speed, frame.span_m, step_s, now[3:])

        # A new receiver frame: the pilot looks (late) and moves the sticks.
        if i % hands.period_steps == 0:
            row = i // hands.period_steps
            for k in range(4):
                held[4 + k] += 0.02 * (
                    -held[4 + k] + hands.remnant_rad * 10.0 * stick_noise[row, 4 + k]
                )
                held[k] = trimmed[k] + program[i, k] + held[4 + k] * (1.0 if flying else 0.0)
            if flying:
                j = max(i - hands.delay_steps, hands.ground_steps)
                s = states[j] if j < i else x
                phi = math.atan2(
                    2 * (s[Q2] * s[Q3] + s[Q0] * s[Q1]),
                    s[Q0] ** 2 - s[Q1] ** 2 - s[Q2] ** 2 + s[Q3] ** 2,
                )
                sine = min(max(-2 * (s[Q1] * s[Q3] - s[Q0] * s[Q2]), -1.0), 1.0)
                theta = math.asin(sine)
                # A pilot judges airspeed by sound and response, so gusts are left out.
                su, sv, sw = rotate_to_body(s, wind[0], wind[1], wind[2])
                seen = math.sqrt((s[0] - su) ** 2 + (s[1] - sv) ** 2 + (s[2] - sw) ** 2)
                weight = attention[i]
                slow = airspeed_mps[i] - seen
                powered = i < hands.cut_step
                wish = held[8]
                if powered:
                    wish += min(
                        max(hands.height_gain_radpm * (hands.height_m + s[DOWN]), -0.15), 0.15
                    )
                else:
                    wish += min(max(-0.2 - 0.03 * slow, -0.5), 0.1)
                held[0] += weight * hands.pitch_gain * (wish - theta)
                bank = bank_rad[i]
                if len(aim_m) > 0 and aim_m[i, 0] < NOWHERE_M:
                    north, east, _ = rotate_to_ned(s, s[0], s[1], s[2])
                    off = math.atan2(aim_m[i, 1] - s[EAST], aim_m[i, 0] - s[NORTH])
                    off -= math.atan2(east, north)
                    off = math.atan2(math.sin(off), math.cos(off))
                    bank += min(max(off, -STEER_RAD), STEER_RAD)
                held[1] += weight * hands.bank_gain * (bank - phi)
                held[3] += weight * hands.speed_gain_smpm * slow
            for k in range(3):
                held[k] = min(max(held[k], -limit[k]), limit[k])
            held[3] = min(max(held[3], 0.0), 1.0)
            if not flying:
                held[3] = 0.0
            # Trim tabs were set before the test: neutral is where the surface stands straight.
            zero = hands.servo_zero_rad
            pulses[row, 0] = NEUTRAL_US + THROW_US * (held[1] - zero[1]) / limit[1]
            pulses[row, 1] = NEUTRAL_US + THROW_US * (held[0] - zero[0]) / limit[0]
            pulses[row, 2] = NEUTRAL_US + THROW_US * (held[2] - zero[2]) / limit[2]
            pulses[row, 3] = IDLE_US + 2.0 * THROW_US * held[3]
            pulses[row, 4] = switch_us[i]
            for k in range(5):
                pulses[row, k] += hands.jitter_us * stick_noise[row, 8 + k]
                if link[row] == LINK_PRESET:
                    pulses[row, k] = preset_us[k]

        # A servo moves when its pulse has ended, some later than others.
        since_us = (i % hands.period_steps) * step_s * 1e6
        row = i // hands.period_steps
        end = 0.0
        for k in range(4):
            end += pulses[row, k]
            if link[row] == LINK_LOST:
                command[3] = 0.0  # without pulses a servo stays, a speed controller stops
            elif k == 3:
                if since_us >= end:
                    command[3] = (pulses[row, 3] - IDLE_US) / (2.0 * THROW_US)
            elif since_us >= end + hands.servo_late_us:
                j = 1 - k if k < 2 else 2  # the receiver's first channel is the aileron
                width_us = pulses[row, k] + (added_us[i, k] if len(added_us) > 0 else 0.0)
                asked_rad = (width_us - NEUTRAL_US) / THROW_US * limit[j]
                asked_rad += hands.servo_zero_rad[j]
                command[j] = hands.servo_gain[j] * asked_rad
            end += GAP_US
        if i >= hands.cut_step or not flying:
            command[3] = 0.0

        states[i] = x
        air[i] = now
        more[i, 7] = rho
        if flying:
            step(frame, x, command, now, rho, step_s, work)
            more[i, 0:3] = work[0, STATE_COUNT : STATE_COUNT + 3]
            more[i, 3:6] = work[0, P : P + 3]
            more[i, 6] = work[0, STATE_COUNT + 3]
        else:
            x[:] = rest
            gx, gy, gz = rotate_to_body(x, 0.0, 0.0, frame.gravity_mps2)
            more[i, 0], more[i, 1], more[i, 2] = -gx, -gy, -gz
            more[i, 3:7] = 0.0
    return last


def fly(
    card: Card,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    aircraft: Aircraft | None = None,
    errors: InstrumentErrors | None = None,
    instrument_seed: int | None = None,
    added_us: Array | None = None,
) -> FlightRecord:
    """Fly a card.

    Parameters
    ----------
    card : Card
    seed : int
        Fixes every random number of the flight.
    progress : callable, optional
        Called with the share flown, 0 to 1.
    aircraft : Aircraft, optional
        In place of the one the card names.
    errors : InstrumentErrors, optional
        What is drawn from; without, the standard errors with the aircraft's tolerances.
    instrument_seed : int, optional
        Fixes what is constant of an instrument; without, every flight has one of its own.
    added_us : (n, 3) array, optional
        What the logger adds to aileron, elevator and rudder at each step: it flies the inputs, of
        a card made by `flown_by_logger`. Of (0, 3): nothing yet.

    Returns
    -------
    FlightRecord

    Raises
    ------
    CardError, AircraftError, TrimError
        The card, its aircraft or the trim it asks for does not work.
    """
    plane = aircraft or load(card.aircraft)
    if plane.straight is not None:
        _refuse_unfit(plane, card)
    # One stream per purpose, so that switching one thing off leaves the others as they were.
    rng_draw, rng_pilot, rng_air, rng_radio = (
        np.random.default_rng([seed, purpose]) for purpose in range(4)
    )
    nominal = [group for group in GROUPS if not getattr(card.sensors, group)]
    draws = draw(
        plane,
        rng_draw,
        tolerances=card.sensors.tolerances,
        nominal=nominal,
        errors=errors,
        of_instrument=(
            None if instrument_seed is None else np.random.default_rng([instrument_seed, 4])
        ),
    )
    frame = true_airframe(plane, draws)
    atmosphere = air_model.atmosphere(
        card.flight.field_pressure_pa, card.flight.field_temperature_degc
    )
    wanted = card.flight.airspeed_mps or plane.scalar("trim.airspeed_mps")
    rho = density_kgpm3(atmosphere, card.flight.height_m)
    trim = solve(frame, wanted, density_kgpm3=rho)
    plan = schedule(card, wanted, STEP_S, rng_pilot, by_logger=added_us is not None)
    n = len(plan.attention)
    period = round(RC_PERIOD_S / STEP_S)
    gain = gains(frame, trim) * card.pilot.gain
    cut = min((f.at_s for f in card.faults if f.kind == "motor_cut"), default=math.inf)
    hands = Hands(
        bank_gain=float(gain[0]),
        pitch_gain=float(gain[1]),
        height_gain_radpm=0.01 * card.pilot.gain,
        speed_gain_smpm=0.03 * card.pilot.gain,
        delay_steps=round(card.pilot.delay_s / STEP_S),
        remnant_rad=card.pilot.remnant * float(frame.surface_limit_rad[0]),
        jitter_us=JITTER_US if card.sensors.receiver_jitter else 0.0,
        period_steps=period,
        ground_steps=round(card.flight.ground_s / STEP_S),
        cut_step=n if math.isinf(cut) else round(cut / STEP_S),
        height_m=card.flight.height_m,
        servo_gain=1.0 + draws.vector("servo_scale_share"),
        servo_zero_rad=draws.vector("servo_zero_rad"),
        servo_late_us=1e6 * float(draws.vector("servo_delay_s")[0]),
    )
    wind = np.array([card.air.wind_north_mps, card.air.wind_east_mps, 0.0])
    heading = math.radians(card.flight.heading_deg)
    launch = trim.state.copy()
    turn = quaternion(0.0, 0.0, heading)
    launch[Q0 : Q3 + 1] = multiply(turn, trim.state[Q0 : Q3 + 1])
    launch[0:3] += rotate_to_body(launch, wind[0], wind[1], wind[2])
    launch[DOWN] = card.flight.climb_m - card.flight.height_m
    rest = np.zeros(STATE_COUNT)
    rest[Q0 : Q3 + 1] = launch[Q0 : Q3 + 1]  # held at its flight attitude until it is let go
    rest[ROTOR - 3 : ROTOR] = trim.command[:3]

    states, air = np.empty((n, STATE_COUNT)), np.empty((n, 9))
    more = np.empty((n, 8))
    frames = -(-n // period)
    pulses = np.zeros((frames, RC_CHANNELS))
    turbulence = air_model.turbulence(card.air, card.flight.height_m)
    noise = rng_air.standard_normal((n if card.air.turbulence_mps > 0.0 else 1, 4))
    stick_noise = rng_radio.standard_normal((frames, 8 + RC_CHANNELS))
    starts = np.arange(frames, dtype=np.float64) * RC_PERIOD_S
    link = np.full(frames, LINK_OK, dtype=np.int64)
    preset = np.array([NEUTRAL_US, NEUTRAL_US, NEUTRAL_US, IDLE_US, SWITCH_DIRECT_US])
    for fault in card.faults:
        if fault.kind == "receiver_lost":
            link[fault.inside(starts)] = LINK_LOST
        elif fault.kind == "receiver_failsafe":
            link[fault.inside(starts)] = LINK_PRESET
            preset[4] = fault.amount
    x, z, command = rest.copy(), np.zeros(GUST_STATES), trim.command.copy()
    added = np.zeros((0, 3)) if added_us is None else added_us
    held = np.zeros(9)
    held[8] = math.asin(
        max(-1.0, min(1.0, -2 * (launch[Q1] * launch[Q3] - launch[Q0] * launch[Q2])))
    )
    done = 0
    chunk = max(period * 50, n // 100 // period * period)
    for first in range(0, n, chunk):
        last = min(first + chunk, n)
        done = fly_steps(
            frame, hands, atmosphere, turbulence, launch, rest, trim.command, plan.program,
            link, preset, plan.attention, plan.bank_rad, plan.airspeed_mps, plan.switch_us, added,
            plan.aim_m, wind, noise, stick_noise, STEP_S, first, last, x, z, held, command, states,
            more, air, pulses,
        )  # fmt: skip
        if progress is not None:
            progress(done / n)
        if done < last:
            break
    rows = -(-done // period)
    return FlightRecord(
        card=card,
        aircraft=plane,
        seed=seed,
        draws=draws,
        frame=frame,
        trim=trim,
        schedule=plan,
        atmosphere=atmosphere,
        t_s=np.arange(done, dtype=np.float64) * STEP_S,
        states=states[:done],
        specific_force_mps2=more[:done, 0:3],
        angular_acceleration_radps2=more[:done, 3:6],
        thrust_n=more[:done, 6],
        density_kgpm3=more[:done, 7],
        air=air[:done],
        pulses_us=pulses[:rows],
        pulse_starts_s=starts[:rows],
    )


def _refuse_unfit(plane: Aircraft, card: Card) -> None:
    """Raise AircraftError where a linear aircraft lacks the card's motor cut or airspeed."""
    speed = plane.scalar("trim.airspeed_mps")
    if any(fault.kind == "motor_cut" for fault in card.faults):
        raise AircraftError(f"{plane.name}: linear, it has no motor to cut as {card.name} wants")
    if card.flight.airspeed_mps and abs(card.flight.airspeed_mps - speed) > 0.1:
        raise AircraftError(
            f"{plane.name}: linear about {speed:.1f} m/s, {card.name} wants"
            f" {card.flight.airspeed_mps:.1f} m/s"
        )
