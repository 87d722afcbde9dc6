"""An aircraft in six degrees of freedom flown by an autopilot's laws at their rate.

Between law and surface stand a pulse every 20 ms, the end of its travel and the servo with its
bandwidth and rate; between motion and law the gyro's noise and filter. The throttle stays,
and the rudder where no damper is given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from host.aircraft.air import GUST_STATES, Air, gust_step, turbulence
from host.aircraft.airframe import (
    AILERON,
    ELEVATOR,
    Q0,
    Q3,
    RUDDER,
    Airframe,
    P,
    Q,
    R,
    U,
    W,
)
from host.aircraft.attitude import euler
from host.aircraft.rigid_body import step
from host.aircraft.trim import Trim
from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.control.actuator import PULSE_PERIOD_S
from host.control.autopilots.structure import Structure
from host.control.lateral_pair import PairProblem
from scipy.signal import butter

AXES = ("roll", "pitch")
LONGEST_STEP_S = 0.0025
HEIGHT_M = 100.0
BANK_RAD, PITCH_RAD = math.radians(90.0), math.radians(60.0)  # beyond: the flight is lost
# Sense of a surface's moment: aileron rolls right, elevator down pitches down, rudder left.
SENSE = {"roll": 1.0, "pitch": -1.0, "yaw": -1.0}
COMMANDS = {"roll": 1, "pitch": 0, "yaw": 2}
SURFACES = {"roll": AILERON, "pitch": ELEVATOR, "yaw": RUDDER}  # in the state


@dataclass(frozen=True)
class Demand:
    """Attitude asked for: a step from trim at a time, and what is added to the laws' outputs.

    Attributes
    ----------
    bank_rad, pitch_rad : float
        Of the step.
    at_s, seconds : float
        When, and how long the flight is.
    injected : mapping of str to Array
        Shares of travel by axis, one a step of the law.
    """

    bank_rad: float = 0.0
    pitch_rad: float = 0.0
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
        By how much pulses come behind the law's step.
    full_rad : float or None
        Angle of the surface at an output of 1; None is the end of its travel.
    pair : PairProblem or None
        Aileron and rudder as they were tuned; the rudder's gains are under ``yaw``.
    coordinated : bool
        Whether pitch is fed the rate of a turn, as ArduPlane and PX4 do.
    """

    frame: Airframe
    trim: Trim
    laws: Mapping[str, Structure]
    gains: Mapping[str, Mapping[str, float]]
    pulse_s: float = 0.5 * PULSE_PERIOD_S
    full_rad: float | None = None
    pair: PairProblem | None = None
    coordinated: bool = True

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


def fly(
    loop: ClosedLoop,
    demand: Demand,
    *,
    turbulence_mps: float = 0.0,
    gyro_noise_radps: float = 0.0,
    seed: int = 0,
) -> Flown:
    """Fly one aircraft from its trim.

    Parameters
    ----------
    loop : ClosedLoop
    demand : Demand
    turbulence_mps, gyro_noise_radps : float
        Standard deviations of the vertical gust and of the noise of each gyro.
    seed : int
    """
    rng = np.random.default_rng([seed, 48])
    frame, x = loop.frame, loop.trim.state.copy()
    speed = loop.trim.airspeed_mps
    laws = {axis: loop.laws[axis].loop(loop.gains[axis], speed) for axis in AXES}
    period = laws["roll"].period_s
    parts = math.ceil(period / LONGEST_STEP_S)
    span = period / parts
    pulse_steps = max(round(PULSE_PERIOD_S / span), 1)
    first_pulse = round(loop.pulse_s / span)
    states: dict[str, Array] = {axis: np.zeros(laws[axis].states) for axis in AXES}
    rudder = loop.pair.yaw.loop(loop.gains["yaw"], speed) if loop.pair else None
    mix = loop.pair.yaw.mix(loop.gains["yaw"]) if loop.pair else 0.0
    damped: Array = np.zeros(rudder.states if rudder else 0)
    moving = loop.moving
    corner_hz = loop.laws["roll"].gyro_filter_hz
    gyro = {axis: _Filter(corner_hz, 1.0 / span) for axis in moving}
    air, gusts = np.zeros(9), np.zeros(GUST_STATES)
    dryden = turbulence(Air(turbulence_mps=turbulence_mps), HEIGHT_M)
    start = euler(x[Q0 : Q3 + 1])
    at_trim = {"roll": float(start[0]), "pitch": float(start[1])}
    count = round(demand.seconds / period)
    kept: dict[str, dict[str, list[float]]] = {
        name: {axis: [] for axis in moving} for name in ("angle", "output", "total", "surface")
    }
    work, moved = np.empty((5, len(x) + 4)), np.zeros(6)
    held = loop.trim.command.copy()
    full_rad = {axis: loop.full_travel_rad(axis) for axis in moving}
    rates, outputs, total = (dict.fromkeys(moving, 0.0) for _ in range(3))
    lost = False
    for k in range(count):
        phi, theta, _ = (float(one) for one in euler(x[Q0 : Q3 + 1]))
        seen = {"roll": phi, "pitch": theta}
        stepped = k * period >= demand.at_s
        asked = {
            "roll": at_trim["roll"] + demand.bank_rad * stepped,
            "pitch": at_trim["pitch"] + demand.pitch_rad * stepped,
        }
        for axis in AXES:
            error = asked[axis] - seen[axis]
            rate = rates[axis]
            if axis == "pitch" and loop.coordinated:
                # The turn's own pitch rate is no error.
                rate -= _turn_radps(phi, theta, float(np.hypot(x[U], x[W])))
            states[axis], out = laws[axis].step(states[axis], np.array(error), np.array(rate))
            outputs[axis] = float(out)
        if rudder:
            damped, out = rudder.step(damped, np.array(-phi), np.array(rates["yaw"]))
            # The law's own aileron is mixed: what is injected stands for its servo alone.
            outputs["yaw"] = float(out) + mix * outputs["roll"]
        for axis in moving:
            injected = demand.injected.get(axis)
            total[axis] = outputs[axis] + (0.0 if injected is None else float(injected[k]))
            for name, value in (
                ("angle", seen.get(axis, 0.0)), ("output", outputs[axis]), ("total", total[axis]),
                ("surface", x[SURFACES[axis]]),
            ):  # fmt: skip
                kept[name][axis].append(float(value))
        for j in range(parts):
            if (k * parts + j - first_pulse) % pulse_steps == 0:
                for axis in moving:
                    number = COMMANDS[axis]
                    limit = frame.surface_limit_rad[number]
                    angle = min(max(total[axis] * full_rad[axis], -limit), limit)
                    held[number] = loop.trim.command[number] + angle * SENSE[axis]
            if turbulence_mps > 0.0:
                noise = rng.standard_normal(4)
                gust_step(dryden, gusts, noise, speed, frame.span_m, span, moved)
                air[3:] = moved
            step(frame, x, held, air, loop.trim.density_kgpm3, span, work)
            for axis, number in zip(moving, (P, Q, R), strict=False):
                noise_radps = gyro_noise_radps * rng.standard_normal() if gyro_noise_radps else 0.0
                rates[axis] = gyro[axis].step(float(x[number]) + noise_radps)
        if not np.isfinite(x).all() or abs(phi) > BANK_RAD or abs(theta) > PITCH_RAD:
            lost = True
            break
    arrays = {
        name: {axis: np.array(values) for axis, values in by.items()} for name, by in kept.items()
    }
    t = period * np.arange(len(arrays["angle"]["roll"]))
    return Flown(t, arrays["angle"], arrays["output"], arrays["total"], arrays["surface"], lost)


def _turn_radps(phi: float, theta: float, airspeed_mps: float) -> float:
    """Return the pitch rate of a level turn at a bank angle."""
    turn = GRAVITY_MPS2 / airspeed_mps * math.tan(phi) * math.sin(phi)
    return turn * math.cos(theta)


class _Filter:
    """The gyro's low-pass of second order, sample by sample."""

    def __init__(self, corner_hz: float, rate_hz: float) -> None:
        b, a = butter(2, corner_hz, fs=rate_hz)
        self._b: list[float] = [float(one) for one in b]
        self._a: list[float] = [float(one) for one in a]
        self._state = [0.0, 0.0]

    def step(self, value: float) -> float:
        b, a, s = self._b, self._a, self._state
        out = b[0] * value + s[0]
        s[0] = b[1] * value - a[1] * out + s[1]
        s[1] = b[2] * value - a[2] * out
        return out
