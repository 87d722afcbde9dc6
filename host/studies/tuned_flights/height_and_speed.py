"""Height and speed as ArduPlane and PX4 hold them: total energy by throttle, its balance by pitch.

Laws: libraries/AP_TECS/AP_TECS.cpp (ArduPlane 4.7-dev) and src/lib/tecs/TECS.cpp (PX4 main
00d281a), with the defaults of their parameters. Speed limits and cruise are the aircraft's.
Integrals begin as a steady flight leaves them. Left out: what protects against too little speed
and too steep descents, turns, take-off and landing; PX4's limit of jerk, 1000 m/s3. INAV makes
throttle of pitch and holds no airspeed; the logger has no throttle: neither has a law here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from host.aircraft.airframe import DOWN, Q0, Q3, P, U, W
from host.aircraft.airframe import Array as State
from host.aircraft.attitude import euler
from host.arrays import Array
from host.constants import GRAVITY_MPS2 as G
from host.control.autopilots import parameter_table
from host.control.outer_loops import airspeed_gains

UPDATE_S = 0.02  # ArduPlane's update_50hz; PX4 takes positions at 50 Hz


@dataclass(frozen=True)
class Seen:
    """What the autopilot knows of each aircraft, every array of shape (N,)."""

    height_m: Array
    climb_mps: Array
    airspeed_mps: Array
    forward_mps2: Array  # along the body's axis, gravity's part taken out
    pitch_rad: Array


def sensed(x: State, before: State, air: State) -> Seen:
    """Return what sensors without error say of states and of those an update before.

    Parameters
    ----------
    x, before : Array, shape (N, 17)
    air : Array, shape (N, 9)
        Motion of the air, in body axes from the fourth.
    """
    _, theta, _ = euler(x[:, Q0 : Q3 + 1])
    u, v, w = x[:, U : W + 1].T
    _, q, r = x[:, P : P + 3].T
    return Seen(
        -x[:, DOWN],
        (before[:, DOWN] - x[:, DOWN]) / UPDATE_S,
        np.linalg.norm(x[:, U : W + 1] - air[:, 3:6], axis=1),
        (u - before[:, U]) / UPDATE_S + q * w - r * v,
        theta,
    )


@dataclass(frozen=True)
class Speeds:
    """Airspeeds that the owner sets, m/s."""

    least: float
    cruise: float
    most: float


class EnergyLaw(Protocol):
    """The law of one autopilot for many aircraft."""

    def step(self, height_m: Array, airspeed_mps: Array, now: Seen) -> tuple[Array, Array]:
        """Return the pitch (rad) and throttle (0 to 1) asked, from what is demanded and seen."""


Begin = Callable[[Seen, Array], EnergyLaw]  # from a steady flight and its throttle


class ArduPlaneEnergy:
    """TECS of ArduPlane; speed is filtered at 50 Hz, the rest goes at 10 Hz."""

    TURN = 5
    DT = TURN * UPDATE_S
    CLIMB, SINK_LEAST, SINK_MOST = 5.0, 2.0, 5.0  # TECS_CLMB_MAX, SINK_MIN, SINK_MAX
    THROTTLE_DAMPING, VERTICAL_MPS2 = 0.5, 7.0  # TECS_THR_DAMP, VERT_ACC
    SPEED_RADPS, HEIGHT_S = 2.0, 3.0  # TECS_SPD_OMEGA, HDEM_TCONST
    CRUISE_THROTTLE, SLEW_PER_S = 0.45, 1.0  # TRIM_THROTTLE, THR_SLEWRATE
    LOWEST_RAD, HIGHEST_RAD = np.radians([-25.0, 15.0])  # PTCH_LIM_MIN_DEG, TECS_PITCH_MAX

    def __init__(self, speeds: Speeds, now: Seen, throttle: Array) -> None:
        n = len(throttle)
        self.time_s, self.damping, self.gain = parameter_table.named(
            "ardupilot", "height", {}
        ).values()
        self.speeds, self.count = speeds, 0
        self.speed, self.drift = now.airspeed_mps.copy(), np.zeros(n)
        self.recent = np.zeros((self.TURN, n))
        self.slow_rate = np.zeros(n)
        self.most = np.full(n, speeds.most)
        self.asked_speed = now.airspeed_mps.copy()
        self.slow_asked_rate = np.zeros(n)
        self.height_in, self.limited, self.height = (now.height_m.copy() for _ in range(3))
        self.climb_share, self.sink_share = np.ones(n), np.ones(n)
        self.pitch = now.pitch_rad.copy()
        self.unlimited = now.pitch_rad.copy()
        self.balance, self.kinetic = now.pitch_rad * now.airspeed_mps * G, np.zeros(n)
        self.throttle, self.rest = throttle.copy(), throttle - self.CRUISE_THROTTLE
        self.fed, self.error = np.full(n, self.CRUISE_THROTTLE), np.zeros(n)
        self.balance_ends, self.throttle_ends = np.zeros(n), np.zeros(n)  # -1, 0, 1: at which limit

    def step(self, height_m: Array, airspeed_mps: Array, now: Seen) -> tuple[Array, Array]:
        """Return the pitch (rad) and throttle (0 to 1) asked, from what is demanded and seen."""
        self.recent[self.count % self.TURN] = now.forward_mps2
        rate = self.recent.mean(axis=0)
        self.slow_rate += UPDATE_S / (UPDATE_S + self.time_s) * (rate - self.slow_rate)
        off = now.airspeed_mps - self.speed
        self.drift += UPDATE_S * self.SPEED_RADPS**2 * off
        self.speed += UPDATE_S * (self.drift + rate + np.sqrt(2.0) * self.SPEED_RADPS * off)
        self.count += 1
        if self.count % self.TURN == 0:
            kinetic = self._kinetic_demand(airspeed_mps)
            potential, climb = self._height_demand(height_m)
            rates = G * now.climb_mps, self.speed * (rate - self.slow_rate)
            self._pitch(potential - G * now.height_m, climb, kinetic[0], rates)
            self._throttle(potential - G * now.height_m, kinetic, rates)
        return self.pitch, self.throttle

    def _kinetic_demand(self, airspeed_mps: Array) -> tuple[Array, Array]:
        """Return what kinetic energy lacks, and its demanded rate."""
        gain, loss = G * self.CLIMB * self.climb_share, -G * self.SINK_LEAST
        slowed = self.throttle_ends > 0.0
        # Each of the updates at 50 Hz moves it by the step of 10 Hz.
        wound = np.where(slowed, 0.5 * loss, 0.5 * gain) / self.speed * self.DT * self.TURN
        least = np.where(slowed, self.speeds.cruise, -np.inf)
        self.most = np.minimum(np.maximum(self.most + wound, least), self.speeds.most)
        wanted = np.clip(airspeed_mps, self.speeds.least, self.most)
        slowest, fastest = 0.9 * loss / self.speeds.cruise, -0.9 * G * self.SINK_MOST / self.most
        share = (self.speed - self.speeds.cruise) / np.maximum(self.most - self.speeds.cruise, 1e-6)
        lowest = slowest + (fastest - slowest) * np.clip(share, 0.0, 1.0)
        rate = np.clip((wanted - self.asked_speed) / self.DT, lowest, 0.5 * gain / self.speed)
        self.asked_speed = np.clip(self.asked_speed + self.DT * rate, self.speeds.least, self.most)
        self.slow_asked_rate += self.DT / (self.DT + self.time_s) * (rate - self.slow_asked_rate)
        lacking = 0.5 * (self.asked_speed**2 - self.speed**2)
        return lacking, self.speed * (rate - self.slow_asked_rate)

    def _height_demand(self, height_m: Array) -> tuple[Array, Array]:
        """Return the potential energy asked and the rate of the height asked."""
        high, low = self.unlimited > self.HIGHEST_RAD, self.unlimited < self.LOWEST_RAD
        full, idle = self.throttle_ends > 0.0, self.throttle_ends < 0.0
        waits = (high | full) & (height_m > self.height_in)
        waits |= (low | idle) & (height_m < self.height_in)
        taken = np.where(waits, self.height_in, height_m)
        middle, self.height_in = 0.5 * (taken + self.height_in), taken
        self.limited = self.limited + np.clip(
            middle - self.limited,
            -self.DT * self.SINK_MOST * self.sink_share,
            self.DT * self.CLIMB * self.climb_share,
        )
        share = self.DT / (self.DT + self.HEIGHT_S)
        rate = (self.limited - self.height) / self.HEIGHT_S
        before, self.height = self.height, self.height + share * (self.limited - self.height)
        up = (high | full | (self.balance_ends > 0.0)) & (self.height > before)
        down = ~up & (low | idle | (self.balance_ends < 0.0)) & (self.height < before)
        grown = ~(up | down)
        self.climb_share = np.where(
            up, self.climb_share * (1.0 - share),
            np.where(grown, self.climb_share + share * (1.0 - self.climb_share), self.climb_share),
        )  # fmt: skip
        self.sink_share = np.where(
            down, self.sink_share * (1.0 - share),
            np.where(grown, self.sink_share + share * (1.0 - self.sink_share), self.sink_share),
        )  # fmt: skip
        return G * self.height, rate

    def _pitch(
        self, potential: Array, climb: Array, kinetic: Array, rates: tuple[Array, Array]
    ) -> None:
        error = potential - kinetic
        free = G * climb + error / self.time_s
        asked = np.clip(free, -G * self.SINK_MOST, G * self.CLIMB)
        self.balance_ends = np.sign(free - asked)
        off = asked - (rates[0] - rates[1])
        total, per_rad = asked + self.damping * off, G * self.speed
        lowest = per_rad * (self.LOWEST_RAD - np.radians(5.0)) - total
        highest = per_rad * (self.HIGHEST_RAD + np.radians(5.0)) - total
        most = 0.1 * (highest - lowest)
        more = np.clip(self.DT * self.gain * off, -most, most)
        unlimited = (total + self.balance + more + self.kinetic) / per_rad
        stopped = ((unlimited > self.HIGHEST_RAD) & (more > 0.0)) | (
            (unlimited < self.LOWEST_RAD) & (more < 0.0)
        )
        fading = self.time_s / (self.DT + self.time_s)
        slower = -kinetic * self.DT / self.time_s
        balance = np.where(stopped, fading * self.balance, self.balance + more)
        self.balance = np.clip(balance, lowest, highest)
        most = 0.25 * (self.HIGHEST_RAD - self.LOWEST_RAD) * per_rad
        faster = np.where(stopped, fading * self.kinetic, self.kinetic + slower)
        self.kinetic = np.clip(faster, -most, most)
        self.unlimited = (total + self.balance + self.kinetic) / per_rad
        wanted = np.clip(self.unlimited, self.LOWEST_RAD, self.HIGHEST_RAD)
        turn = self.DT * self.VERTICAL_MPS2 / self.speed
        self.pitch = self.pitch + np.clip(wanted - self.pitch, -turn, turn)

    def _throttle(
        self, potential: Array, kinetic: tuple[Array, Array], rates: tuple[Array, Array]
    ) -> None:
        gain, loss = G * self.CLIMB * self.climb_share, -G * self.SINK_LEAST
        own = 0.5 * self.speed**2
        lowest = np.minimum(own - 0.5 * self.most**2, 0.0)
        highest = np.maximum(own - 0.5 * self.speeds.least**2, 0.0)
        error = np.clip(potential, lowest, highest) + kinetic[0]
        asked = np.clip(potential / self.time_s + kinetic[1], loss, gain)
        # A filter of half a second.
        self.error = self.error + 2.0 * self.DT * (asked - rates[0] - rates[1] - self.error)
        per_share = gain - loss
        fed = self.CRUISE_THROTTLE + asked / per_share
        fed = fed + (error + self.THROTTLE_DAMPING * self.error) / (self.time_s * per_share)
        rest = self.rest + self.DT * self.gain * error / (self.time_s * per_share)
        self.rest = np.clip(rest, np.clip(-fed - 0.1, -0.5, 0.5), np.clip(1.1 - fed, -0.5, 0.5))
        turn = self.DT * self.SLEW_PER_S
        self.fed = self.fed + np.clip(fed - self.fed, -turn, turn)
        free = self.fed + self.rest
        self.throttle = np.clip(free, 0.0, 1.0)
        self.throttle_ends = np.sign(free - self.throttle)


class Px4Energy:
    """TECS of PX4."""

    CLIMB, SINK_LEAST, SINK_MOST = 5.0, 2.0, 5.0  # FW_T_CLMB_MAX, SINK_MIN, SINK_MAX
    CLIMB_ASKED, SINK_ASKED = 3.0, 2.0  # FW_T_CLMB_R_SP, SINK_R_SP
    HEIGHT_AHEAD, VERTICAL_MPS2 = 0.3, 7.0  # FW_T_HRATE_FF, VERT_ACC
    THROTTLE_DAMPING, THROTTLE_GAIN, ENERGY_S = 0.05, 0.02, 0.4  # FW_T_THR_DAMPING, INTEG, STE_R_TC
    CRUISE_THROTTLE = 0.6  # FW_THR_TRIM
    STEEPEST_RAD = np.radians(30.0)  # FW_P_LIM_MAX, MIN

    def __init__(self, speeds: Speeds, now: Seen, throttle: Array) -> None:
        n = len(throttle)
        self.tuned = tuple(parameter_table.named("px4", "height", {}).values())
        self.filter = airspeed_gains(*parameter_table.named("px4", "airspeed_filter", {}).values())
        self.speeds = speeds
        self.state = np.stack([now.airspeed_mps, np.zeros(n)])
        self.height, self.climb = now.height_m.copy(), np.zeros(n)
        self.pitch, self.balance = now.pitch_rad.copy(), now.pitch_rad.copy()
        self.throttle, self.rest = throttle.copy(), throttle - self.CRUISE_THROTTLE
        self.energy_rate = np.zeros(n)

    def step(self, height_m: Array, airspeed_mps: Array, now: Seen) -> tuple[Array, Array]:
        """Return the pitch (rad) and throttle (0 to 1) asked, from what is demanded and seen."""
        height_s, speed_s, damping, gain, ahead, weight = self.tuned
        at_height, at_speed = np.clip([2.0 - weight, weight], 0.0, 1.0).tolist()
        self.state[0] += UPDATE_S * self.state[1]
        off = np.stack([now.airspeed_mps, now.forward_mps2]) - self.state
        self.state = self.state + UPDATE_S * self.filter @ off
        speed, rate = self.state
        self._reference(height_m)
        climb = (self.height - now.height_m) / height_s + self.HEIGHT_AHEAD * self.climb
        potential = G * np.clip(climb, -self.SINK_MOST, self.CLIMB)
        gain_most, loss_most = G * self.CLIMB, -G * self.SINK_LEAST
        wanted = np.clip(airspeed_mps, self.speeds.least, self.speeds.most)
        kinetic = np.clip((wanted - speed) / speed_s * speed, 0.5 * loss_most, 0.5 * gain_most)
        seen_rates = G * now.climb_mps, speed * rate
        # Pitch: the balance of the two.
        asked = at_height * potential - at_speed * kinetic
        error = asked - (at_height * seen_rates[0] - at_speed * seen_rates[1])
        more = gain * error / (speed * G)
        more = np.where(self.pitch >= self.STEEPEST_RAD, np.minimum(more, 0.0), more)
        more = np.where(self.pitch <= -self.STEEPEST_RAD, np.maximum(more, 0.0), more)
        self.balance = self.balance + UPDATE_S * more
        angle = (damping * error + ahead * asked) / (speed * G) + self.balance
        turn = UPDATE_S * self.VERTICAL_MPS2 / speed
        angle = np.clip(angle, -self.STEEPEST_RAD, self.STEEPEST_RAD)
        self.pitch = self.pitch + np.clip(angle - self.pitch, -turn, turn)
        # Throttle: their sum.
        taken = UPDATE_S / (UPDATE_S + self.ENERGY_S)
        self.energy_rate = self.energy_rate + taken * (
            seen_rates[0] + seen_rates[1] - self.energy_rate
        )
        total = np.clip(potential + kinetic, loss_most, gain_most)
        error = (total - self.energy_rate) / (gain_most - loss_most)
        more = self.THROTTLE_GAIN * error
        more = np.where(self.throttle >= 1.0, np.minimum(more, 0.0), more)
        more = np.where(self.throttle <= 0.0, np.maximum(more, 0.0), more)
        self.rest = self.rest + UPDATE_S * more
        fed = np.where(
            total >= 0.0,
            total / gain_most * (1.0 - self.CRUISE_THROTTLE),
            -total / loss_most * self.CRUISE_THROTTLE,
        )
        free = self.CRUISE_THROTTLE + fed + self.THROTTLE_DAMPING * error + self.rest
        self.throttle = np.clip(free, 0.0, 1.0)
        return self.pitch, self.throttle

    def _reference(self, height_m: Array) -> None:
        """Move the height that is followed: as fast as it can still stop at the one demanded."""
        left = height_m - self.height
        fastest = np.sqrt(2.0 * self.VERTICAL_MPS2 * np.abs(left))
        # The last step ends at it.
        wanted = np.sign(left) * np.minimum(fastest, np.abs(left) / UPDATE_S)
        wanted = np.clip(wanted, -self.SINK_ASKED, self.CLIMB_ASKED)
        turn = UPDATE_S * self.VERTICAL_MPS2
        self.climb = self.climb + np.clip(wanted - self.climb, -turn, turn)
        self.height = self.height + UPDATE_S * self.climb


ENERGY_LAWS: Mapping[str, Callable[[Speeds, Seen, Array], EnergyLaw]] = {
    "ardupilot": ArduPlaneEnergy,
    "px4": Px4Energy,
}
