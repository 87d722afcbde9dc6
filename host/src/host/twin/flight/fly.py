"""One flight: pilot, radio, aircraft and air, integrated together at 1 kHz."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from host.aircraft import air as air_model
from host.aircraft.air import GUST_STATES, Atmosphere, density_kgpm3
from host.aircraft.airframe import DOWN, Q0, Q1, Q2, Q3, ROTOR, STATE_COUNT, Airframe, Array
from host.aircraft.attitude import multiply, quaternion
from host.aircraft.file import Aircraft, AircraftError
from host.aircraft.linear_aircraft import load
from host.aircraft.rigid_body import rotate_to_body, rotate_to_ned
from host.aircraft.trim import Trim, solve
from host.instrument.instrument_errors import InstrumentErrors
from host.twin.flight.draws import GROUPS, Draws, draw, true_airframe
from host.twin.flight.flight_steps import fly_steps
from host.twin.flight.ground_tilts import tilted
from host.twin.flight.pilot import SWITCH_DIRECT_US, Schedule, gains, schedule
from host.twin.flight.stick_commands import (
    IDLE_US,
    LINK_LOST,
    LINK_OK,
    LINK_PRESET,
    NEUTRAL_US,
    Hands,
    Radio,
)
from host.twin.testcard.cards import Card

STEP_S = 1e-3
RC_PERIOD_S = 0.020
RC_CHANNELS = 5  # aileron, elevator, rudder, throttle, switch
JITTER_US = 1.0  # rms of a receiver's width


@dataclass(frozen=True, slots=True)
class FlightRecord:
    """What really happened, on the grid `t_s` (n,), 1 kHz. It ends at the card's end, or where the
    ground is touched: there is no model of a landing.

    Attributes
    ----------
    seed : int
        Seed of air and sensor noise.
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
    card, aircraft, draws, frame, trim, schedule
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
        return len(self.t_s) < len(self.schedule.orders.attention)

    @property
    def sink_mps(self) -> float:
        """Vertical speed at the last sample, downwards."""
        return float(rotate_to_ned(self.states[-1], *self.states[-1, :3])[2])


# Gets the flight, filled as it is flown, and the additions (n, 3), us, that it is to fill. Returns
# a function that gets how many steps are flown and says up to which to fly on.
LoopedLogger = Callable[[FlightRecord, Array], Callable[[int], int]]


def fly(
    card: Card,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    aircraft: Aircraft | None = None,
    errors: InstrumentErrors | None = None,
    instrument_seed: int | None = None,
    noise_seed: int | None = None,
    added_us: Array | None = None,
    logger: LoopedLogger | None = None,
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
    noise_seed : int, optional
        Fixes gusts and the noise of the sensors: pilot's inputs, aircraft and instrument of `seed`
        in another air. Without, `seed` does.
    added_us : (n, 3) array, optional
        What the logger adds to aileron, elevator and rudder at each step: it flies the inputs, of
        a card made by `flown_by_logger`. Nothing yet: (0, 3).
    logger : callable, optional
        The logger in the same loop, of such a card that holds axes: see `LoopedLogger`. The
        pilot tilts the aircraft on the ground.

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
    noise_seed = seed if noise_seed is None else noise_seed
    rng_draw, rng_pilot, rng_air, rng_radio = (
        np.random.default_rng([own, purpose])
        for purpose, own in enumerate((seed, seed, noise_seed, seed))
    )
    draws = draw(
        plane,
        rng_draw,
        tolerances=card.sensors.tolerances,
        nominal=[group for group in GROUPS if not getattr(card.sensors, group)],
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
    trim = solve(frame, wanted, density_kgpm3=density_kgpm3(atmosphere, card.flight.height_m))
    by_logger = added_us is not None or logger is not None
    plan = schedule(card, wanted, STEP_S, rng_pilot, by_logger=by_logger, holds=logger is not None)
    n = len(plan.orders.attention)
    hands = _hands(card, frame, trim, draws, n)
    wind = np.array([card.air.wind_north_mps, card.air.wind_east_mps, 0.0])
    launch, rest = _start(card, trim, wind)
    rest = tilted(rest, hands.ground_steps, STEP_S) if logger is not None else rest[None]

    period = hands.period_steps
    frames = -(-n // period)
    starts = np.arange(frames, dtype=np.float64) * RC_PERIOD_S
    link, preset = _link(card, starts)
    if logger is not None:
        added_us = np.zeros((n, 3))
    radio = Radio(link, preset, np.zeros((0, 3)) if added_us is None else added_us)
    turbulence = air_model.turbulence(card.air, card.flight.height_m)
    noise = rng_air.standard_normal((n if card.air.turbulence_mps > 0.0 else 1, 4))
    stick_noise = rng_radio.standard_normal((frames, 8 + RC_CHANNELS))
    states, air, more = np.empty((n, STATE_COUNT)), np.empty((n, 9)), np.empty((n, 8))
    pulses = np.zeros((frames, RC_CHANNELS))
    x, z, command = rest[-1].copy(), np.zeros(GUST_STATES), trim.command.copy()
    held = np.zeros(9)
    held[8] = math.asin(
        max(-1.0, min(1.0, -2 * (launch[Q1] * launch[Q3] - launch[Q0] * launch[Q2])))
    )
    flown = FlightRecord(
        card=card,
        aircraft=plane,
        seed=noise_seed,
        draws=draws,
        frame=frame,
        trim=trim,
        schedule=plan,
        atmosphere=atmosphere,
        t_s=np.arange(n, dtype=np.float64) * STEP_S,
        states=states,
        specific_force_mps2=more[:, 0:3],
        angular_acceleration_radps2=more[:, 3:6],
        thrust_n=more[:, 6],
        density_kgpm3=more[:, 7],
        air=air,
        pulses_us=pulses,
        pulse_starts_s=starts,
    )
    chunk = max(period * 50, n // 100 // period * period)
    follow = None if logger is None else logger(flown, radio.added_us)
    done = first = 0
    while first < n:
        last = min(first + chunk if follow is None else follow(first), n)
        done = fly_steps(
            frame, hands, plan.orders, radio, atmosphere, turbulence, trim.command, launch, rest,
            wind, noise, stick_noise, STEP_S, first, last, x, z, held, command, states, more, air,
            pulses,
        )  # fmt: skip
        if progress is not None:
            progress(done / n)
        first = last
        if done < last:
            break
    if follow is not None:
        follow(done)
    rows = -(-done // period)
    return replace(
        flown,
        t_s=flown.t_s[:done],
        states=states[:done],
        specific_force_mps2=more[:done, 0:3],
        angular_acceleration_radps2=more[:done, 3:6],
        thrust_n=more[:done, 6],
        density_kgpm3=more[:done, 7],
        air=air[:done],
        pulses_us=pulses[:rows],
        pulse_starts_s=starts[:rows],
    )


def _hands(card: Card, frame: Airframe, trim: Trim, draws: Draws, steps: int) -> Hands:
    """Return what the kernel needs of pilot, radio and servos, for a flight of so many steps."""
    gain = gains(frame, trim) * card.pilot.gain
    cut = min((f.at_s for f in card.faults if f.kind == "motor_cut"), default=math.inf)
    return Hands(
        bank_gain=float(gain[0]),
        pitch_gain=float(gain[1]),
        height_gain_radpm=0.01 * card.pilot.gain,
        speed_gain_smpm=0.03 * card.pilot.gain,
        delay_steps=round(card.pilot.delay_s / STEP_S),
        remnant_rad=card.pilot.remnant * float(frame.surface_limit_rad[0]),
        jitter_us=JITTER_US if card.sensors.receiver_jitter else 0.0,
        period_steps=round(RC_PERIOD_S / STEP_S),
        ground_steps=round(card.flight.ground_s / STEP_S),
        cut_step=steps if math.isinf(cut) else round(cut / STEP_S),
        height_m=card.flight.height_m,
        servo_gain=1.0 + draws.vector("servo_scale_share"),
        servo_zero_rad=draws.vector("servo_zero_rad"),
        servo_late_us=1e6 * float(draws.vector("servo_delay_s")[0]),
    )


def _start(card: Card, trim: Trim, wind: Array) -> tuple[Array, Array]:
    """Return the states at launch and on the ground before it."""
    launch = trim.state.copy()
    turn = quaternion(0.0, 0.0, math.radians(card.flight.heading_deg))
    launch[Q0 : Q3 + 1] = multiply(turn, trim.state[Q0 : Q3 + 1])
    launch[0:3] += rotate_to_body(launch, wind[0], wind[1], wind[2])
    launch[DOWN] = card.flight.climb_m - card.flight.height_m
    rest = np.zeros(STATE_COUNT)
    rest[Q0 : Q3 + 1] = launch[Q0 : Q3 + 1]  # held at its flight attitude until it is let go
    rest[ROTOR - 3 : ROTOR] = trim.command[:3]
    return launch, rest


def _link(card: Card, starts_s: Array) -> tuple[NDArray[np.int64], Array]:
    """Return how the radio does in every receiver frame, and its pulses without a transmitter."""
    link = np.full(len(starts_s), LINK_OK, dtype=np.int64)
    preset_us = np.array([NEUTRAL_US, NEUTRAL_US, NEUTRAL_US, IDLE_US, SWITCH_DIRECT_US])
    for fault in card.faults:
        if fault.kind == "receiver_lost":
            link[fault.inside(starts_s)] = LINK_LOST
        elif fault.kind == "receiver_failsafe":
            link[fault.inside(starts_s)] = LINK_PRESET
            preset_us[4] = fault.amount
    return link, preset_us


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
