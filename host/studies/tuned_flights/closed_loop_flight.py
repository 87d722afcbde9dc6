"""An aircraft in six degrees of freedom flown by an autopilot's laws at their rate.

Between law and surface stand a pulse every 20 ms, the end of its travel and the servo with its
bandwidth and rate; between motion and law the gyro's noise and filter. The throttle stays
where no law of height and speed is given, and the rudder where no damper is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from host.aircraft.air import GUST_STATES, Air, Turbulence, gust_step, turbulence
from host.aircraft.airframe import (
    AILERON,
    DOWN,
    ELEVATOR,
    Q0,
    Q3,
    RUDDER,
    Airframe,
    P,
    U,
    W,
)
from host.aircraft.airframe import Array as State
from host.aircraft.attitude import euler
from host.aircraft.rigid_body import step
from host.aircraft.trim import Trim
from host.arrays import Array
from host.compiled import compiled_fast, compiled_part, has_compiler
from host.constants import GRAVITY_MPS2
from host.control.actuator import PULSE_PERIOD_S
from host.control.autopilots.structure import Structure
from host.control.lateral_pair import PairProblem
from scipy.signal import butter

from studies.tuned_flights.height_and_speed import UPDATE_S, Begin, sensed

AXES = ("roll", "pitch")
LONGEST_STEP_S = 0.0025
HEIGHT_M = 100.0
BANK_RAD, PITCH_RAD = math.radians(90.0), math.radians(60.0)  # beyond: the flight is lost
# Sense of a surface's moment: aileron rolls right, elevator down pitches down, rudder left.
SENSE = {"roll": 1.0, "pitch": -1.0, "yaw": -1.0}
COMMANDS = {"roll": 1, "pitch": 0, "yaw": 2}
TOGETHER = 100  # steps whose noise is drawn at once
THROTTLE = 3  # behind the surfaces
SURFACES = {"roll": AILERON, "pitch": ELEVATOR, "yaw": RUDDER}  # in the state


@dataclass(frozen=True)
class Demand:
    """What is asked for: a step from trim at a time, and what is added to the laws' outputs.

    Attributes
    ----------
    bank_rad, pitch_rad, height_m, airspeed_mps : float
        Size of the step.
    at_s, seconds : float
        When, and how long the flight is.
    injected : mapping of str to Array
        Shares of travel by axis, one a step of the law.
    """

    bank_rad: float = 0.0
    pitch_rad: float = 0.0
    height_m: float = 0.0
    airspeed_mps: float = 0.0
    at_s: float = 1.0
    seconds: float = 8.0
    injected: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class ClosedLoop:
    """One aircraft with laws and gains.

    Attributes
    ----------
    frame : Airframe
    trim : Trim
    laws : mapping of str to Structure
        By axis.
    gains : mapping of str to mapping
        By axis and role.
    pulse_s : float
        By how much pulses come behind the law's step; flown in whole `LONGEST_STEP_S`.
    full_rad : float or None
        Angle of the surface at an output of 1; None is the end of its travel.
    pair : PairProblem or None
        Aileron and rudder as they were tuned; the rudder's gains are under ``yaw``.
    coordinated : bool
        Whether pitch is fed the rate of a turn, as ArduPlane and PX4 do.
    energy : callable or None
        Begins the law that makes pitch and throttle of height and airspeed; it flies where one of
        these is asked for.
    """

    frame: Airframe
    trim: Trim
    laws: Mapping[str, Structure]
    gains: Mapping[str, Mapping[str, float]]
    pulse_s: float = 0.5 * PULSE_PERIOD_S
    full_rad: float | None = None
    pair: PairProblem | None = None
    coordinated: bool = True
    energy: Begin | None = None

    @property
    def moving(self) -> tuple[str, ...]:
        """Axes that a law drives."""
        return AXES if self.pair is None else (*AXES, "yaw")

    def full_travel_rad(self, axis: str) -> float:
        """Return the angle of a surface at an output of 1."""
        return self.full_rad or float(self.frame.surface_limit_rad[COMMANDS[axis]])


@dataclass(frozen=True)
class Flown:
    """Histories at the law's rate, each of shape (N,), and whether the flight was lost."""

    t_s: Array
    angle_rad: Mapping[str, Array]
    output: Mapping[str, Array]  # of the law alone
    total: Mapping[str, Array]  # with what was injected
    surface_rad: Mapping[str, Array]
    lost: bool
    height_m: Array = field(default_factory=lambda: np.zeros(0))
    airspeed_mps: Array = field(default_factory=lambda: np.zeros(0))


def fly(
    loops: Sequence[ClosedLoop],
    demand: Demand,
    *,
    turbulence_mps: float = 0.0,
    gyro_noise_radps: float = 0.0,
    seeds: Sequence[int] = (0,),
) -> list[Flown]:
    """Fly aircraft from their trims, side by side: the law is asked once for all of them.

    Parameters
    ----------
    loops : sequence of ClosedLoop
        Loops of the same laws, gains and airspeed.
    demand : Demand
    turbulence_mps, gyro_noise_radps : float
        Standard deviations of the vertical gust and of the noise of each gyro.
    seeds : sequence of int
        Seeds of each aircraft's gusts and noise.
    """
    first, n = loops[0], len(loops)
    moving, speed = first.moving, first.trim.airspeed_mps
    laws = {axis: first.laws[axis].loop(first.gains[axis], speed) for axis in AXES}
    rudder = first.pair.yaw.loop(first.gains["yaw"], speed) if first.pair else None
    mix = first.pair.yaw.mix(first.gains["yaw"]) if first.pair else 0.0
    period = laws["roll"].period_s
    parts = math.ceil(period / LONGEST_STEP_S)
    span = period / parts
    count = round(demand.seconds / period)
    pulse_steps = max(round(PULSE_PERIOD_S / span), 1)
    since = np.arange(count * parts) - np.array([[round(one.pulse_s / span)] for one in loops])
    pulses = (since % pulse_steps == 0).reshape(n, count, parts)
    filters = np.array(butter(2, first.laws["roll"].gyro_filter_hz, fs=1.0 / span))
    dryden = turbulence(Air(turbulence_mps=turbulence_mps), HEIGHT_M)
    gusty = turbulence_mps > 0.0

    x = np.array([one.trim.state for one in loops])
    trims = np.array([one.trim.command for one in loops])
    held, wanted = trims.copy(), trims.copy()
    limits, full_rad = (
        {axis: np.array([rad(one, axis) for one in loops]) for axis in moving}
        for rad in (lambda one, axis: one.frame.surface_limit_rad[COMMANDS[axis]],
                    ClosedLoop.full_travel_rad)
    )  # fmt: skip
    states: dict[str, Array] = {axis: np.zeros((n, law.states)) for axis, law in laws.items()}
    damped: Array = np.zeros((n, rudder.states if rudder else 0))
    rates, lagged = np.zeros((n, 3)), np.zeros((n, 3, 2))
    gusts, air, work = np.zeros((n, GUST_STATES)), np.zeros((n, 9)), np.empty((5, x.shape[1] + 4))
    noises = [np.random.default_rng([seed, 48]) for seed in seeds]
    noisy, noise = gusty or gyro_noise_radps > 0.0, np.zeros((n, TOGETHER, parts, 7))
    frames = listed([one.frame for one in loops])
    density_kgpm3 = np.array([one.trim.density_kgpm3 for one in loops])
    at_trim = euler(x[:, Q0 : Q3 + 1])
    kept = {
        name: {axis: np.zeros((n, count)) for axis in moving}
        for name in ("angle", "output", "total", "surface")
    }
    height: Array = np.zeros((n, count))
    airspeed: Array = np.zeros((n, count))
    before, energy, now = x.copy(), None, sensed(x, x, air)
    if first.energy and (demand.height_m or demand.airspeed_mps):
        energy = first.energy(now, trims[:, THROTTLE])
    at_height, at_speed, turn = now.height_m, now.airspeed_mps, max(round(UPDATE_S / period), 1)
    lost, outputs = np.zeros(n, dtype=bool), dict[str, Array]()
    for k in range(count):
        phi, theta, _ = euler(x[:, Q0 : Q3 + 1])
        stepped = k * period >= demand.at_s
        seen = {"roll": phi, "pitch": theta}
        asked: dict[str, Array] = {
            "roll": at_trim[0] + demand.bank_rad * stepped,
            "pitch": at_trim[1] + demand.pitch_rad * stepped,
        }
        height[:, k] = -x[:, DOWN]
        airspeed[:, k] = np.linalg.norm(x[:, U : W + 1] - air[:, 3:6], axis=1)
        if energy and k % turn == 0:
            now, before = sensed(x, before, air), x.copy()
            demanded = (
                at_height + demand.height_m * stepped,
                at_speed + demand.airspeed_mps * stepped,
            )
            pitch, throttle = energy.step(*demanded, now)
            wanted[:, THROTTLE] = throttle
            laws = {
                axis: side_by_side(
                    [first.laws[axis].loop(first.gains[axis], v) for v in now.airspeed_mps]
                )
                for axis in AXES
            }
        if energy:
            asked["pitch"] = pitch
        for number, axis in enumerate(AXES):
            rate = rates[:, number]
            if axis == "pitch" and first.coordinated:
                # The turn's own pitch rate is no error.
                rate = rate - _turn_radps(phi, theta, np.hypot(x[:, U], x[:, W]))
            states[axis], outputs[axis] = laws[axis].step(
                states[axis], asked[axis] - seen[axis], rate
            )
        if rudder:
            damped, out = rudder.step(damped, -phi, rates[:, 2])
            # The law's own aileron is mixed: what is injected stands for its servo alone.
            outputs["yaw"] = out + mix * outputs["roll"]
        for axis in moving:
            injected = demand.injected.get(axis)
            total = outputs[axis] + (0.0 if injected is None else injected[k])
            angle = np.clip(total * full_rad[axis], -limits[axis], limits[axis])
            number = COMMANDS[axis]
            wanted[:, number] = trims[:, number] + angle * SENSE[axis]
            for name, value in (
                ("angle", seen.get(axis, phi)), ("output", outputs[axis]), ("total", total),
                ("surface", x[:, SURFACES[axis]]),
            ):  # fmt: skip
                kept[name][axis][:, k] = value
        lost |= ~np.isfinite(x).all(axis=1)
        lost |= (np.abs(phi) > BANK_RAD) | (np.abs(theta) > PITCH_RAD)
        if noisy and k % TOGETHER == 0:
            noise = np.array([one.standard_normal((TOGETHER, parts, 7)) for one in noises])
        advance_all(
            frames, x, held, wanted, pulses[:, k], air, dryden, gusty, gusts,
            noise[:, k % TOGETHER], gyro_noise_radps, filters, lagged, rates, speed, density_kgpm3,
            span, work, lost,
        )  # fmt: skip
    t = period * np.arange(count)

    def of(name: str, i: int) -> dict[str, Array]:
        return {axis: rows[i] for axis, rows in kept[name].items()}

    return [
        Flown(t, of("angle", i), of("output", i), of("total", i), of("surface", i), bool(lost[i]),
              height[i], airspeed[i])
        for i in range(n)
    ]  # fmt: skip


def side_by_side(loops: Sequence[Any]) -> Any:
    """Return one loop of many that differ by their airspeeds: its numbers have shape (N,)."""
    first = loops[0]
    numbers = [one.name for one in fields(first) if isinstance(getattr(first, one.name), float)]
    return replace(
        first, **{name: np.array([getattr(one, name) for one in loops]) for name in numbers}
    )


def listed(frames: Sequence[Airframe]) -> Sequence[Airframe]:
    """Return a list that machine code takes whole: to unpack a frame at each step takes longer."""
    if not has_compiler():
        return frames
    from numba.typed import List

    found = List()
    for one in frames:
        found.append(one)
    return found  # type: ignore[no-any-return]


@compiled_fast
def advance_all(
    frames: Sequence[Airframe],
    x: State,
    held: State,
    wanted: State,
    pulses: State,
    air: State,
    dryden: Turbulence,
    gusty: bool,
    gusts: State,
    noise: State,
    gyro_noise_radps: float,
    filters: State,
    lagged: State,
    rates: State,
    speed_mps: float,
    density_kgpm3: State,
    step_s: float,
    work: State,
    lost: State,
) -> None:
    """Advance every aircraft that is not lost; arrays are those of `advance`, aircraft first."""
    for i in range(x.shape[0]):
        if not lost[i]:
            advance(
                frames[i], x[i], held[i], wanted[i], pulses[i], air[i], dryden, gusty, gusts[i],
                noise[i], gyro_noise_radps, filters, lagged[i], rates[i], speed_mps,
                density_kgpm3[i], step_s, work,
            )  # fmt: skip


@compiled_part
def advance(
    frame: Airframe,
    x: State,
    held: State,
    wanted: State,
    pulses: State,
    air: State,
    dryden: Turbulence,
    gusty: bool,
    gusts: State,
    noise: State,
    gyro_noise_radps: float,
    filters: State,
    lagged: State,
    rates: State,
    speed_mps: float,
    density_kgpm3: float,
    step_s: float,
    work: State,
) -> None:
    """Advance one aircraft by one period of the law, in place.

    Parameters
    ----------
    frame : Airframe
    x, held, wanted : Array
        State; commands at the servos, and those that the next pulse brings.
    pulses : State, shape (M,)
        Whether one comes at each of the period's steps.
    air : State, shape (9,)
        Scratch: wind and gust.
    dryden, gusty, gusts
        Turbulence, whether there is any, and its filters' states.
    noise : State, shape (M, 7)
        Standard normal: four of the gusts, three of the gyros.
    gyro_noise_radps : float
    filters : State, shape (2, 3)
        Numerator and denominator of the gyro's low-pass.
    lagged, rates : State, shapes (3, 2), (3,)
        Its states and outputs.
    speed_mps, density_kgpm3, step_s : float
    work : Array
        Work array of `step`.
    """
    for j in range(pulses.shape[0]):
        if pulses[j]:
            for i in range(held.shape[0]):
                held[i] = wanted[i]
        if gusty:
            gust_step(dryden, gusts, noise[j], speed_mps, frame.span_m, step_s, air[3:])
        step(frame, x, held, air, density_kgpm3, step_s, work)
        for i in range(3):
            value = x[P + i] + gyro_noise_radps * noise[j, 4 + i]
            out = filters[0, 0] * value + lagged[i, 0]
            lagged[i, 0] = filters[0, 1] * value - filters[1, 1] * out + lagged[i, 1]
            lagged[i, 1] = filters[0, 2] * value - filters[1, 2] * out
            rates[i] = out


def _turn_radps(phi: Array, theta: Array, airspeed_mps: Array) -> Array:
    """Return the pitch rate of a level turn at a bank angle."""
    turn = GRAVITY_MPS2 / airspeed_mps * np.tan(phi) * np.sin(phi)
    return np.asarray(turn * np.cos(theta))
