"""Aileron and rudder together: aircraft drawn with both loops closed, at each airspeed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from host.arrays import Array
from host.control.actuator import Actuator
from host.control.autopilots.structure import YawStructure, state_space
from host.control.disturbances import gust_inputs
from host.control.joint_margin import joint_disk
from host.control.margins import Margins, Spectra, margins
from host.control.plant import Plant, sampled
from host.control.scenarios import POINTS, SLOWEST_RADPS, Problem, closed, padded

STEP_S = 4.0  # of a bank: the roll is over and the Dutch roll has swung
# MIL-F-8785C 3.3.1.3, category B. A yaw integrator (PX4) does not see the sideslip: what force it
# leaves is as little known as Y_beta.
SPIRAL_S = 20.0
PHI, P, R, BETA = range(4)  # what is measured, and the sideslip to judge by
Law = tuple[Array, Array, Array, Array]


@dataclass(frozen=True)
class PairProblem:
    """A tuned roll axis of a lateral model, with its rudder."""

    roll: Problem
    roll_gains: Mapping[str, float]
    rudder: Actuator
    yaw: YawStructure

    def law(self, gains: Mapping[str, float], airspeed_mps: float) -> Law:
        """Return A, B, C, D from bank, roll and yaw rate to aileron and rudder shares."""
        ra, rb, rc, rd = state_space(self.roll.structure.loop(self.roll_gains, airspeed_mps))
        ya, yb, yc, yd = state_space(self.yaw.loop(gains, airspeed_mps))
        mix = self.yaw.mix(gains)
        n, m = len(ra), len(ya)
        a, b = np.zeros((n + m, n + m)), np.zeros((n + m, 3))
        a[:n, :n], a[n:, n:] = ra, ya
        b[:n, [PHI, P]], b[n:, [PHI, R]] = rb, yb
        c, d = np.zeros((2, n + m)), np.zeros((2, 3))
        c[0, :n], c[1, :n], c[1, n:] = rc[0], mix * rc[0], yc[0]
        d[0, [PHI, P]] = rd[0]
        d[1, [PHI, P]] = mix * rd[0]
        d[1, [PHI, R]] += yd[0]
        return a, b, c, d

    @property
    def feed_forward(self) -> float:
        """Share of rudder that holds 1 rad/s of yaw without sideslip: N_r over N_dr."""
        axis = self.roll.axis
        a, b, states = axis.matrices(axis.mean, axis.trim.airspeed_mps)
        r = states.index("r_radps")
        return abs(float(a[r, r] / b[r, 1])) / self.rudder.travel_rad

    @property
    def sense(self) -> float:
        """1 or -1: so that a positive output yaws right, as estimated."""
        axis = self.roll.axis
        _, b, states = axis.matrices(axis.mean, axis.trim.airspeed_mps)
        return float(np.copysign(1.0, b[states.index("r_radps"), 1]))


@dataclass(frozen=True)
class PairScenarios:
    """Aircraft of one drawing at each airspeed, flat as (speeds * N)."""

    problem: PairProblem
    frequency_radps: Array
    plants: tuple[tuple[Plant, ...], ...]
    gusts: Spectra  # (speeds, N, F, 4) per side gust
    gust_power: Array  # (speeds, F)

    @cached_property
    def _transfer(self) -> Spectra:
        w = self.frequency_radps
        return np.array([[one.transfer(w) for one in row] for row in self.plants])

    @cached_property
    def _stacked(self) -> list[tuple[Array, Array, Array]]:
        size = max(len(one.a) for row in self.plants for one in row)
        return [
            (
                np.stack([padded(one.a, size, size) for one in row]),
                np.stack([padded(one.b, size, 2) for one in row]),
                np.stack([padded(one.c, 4, size) for one in row]),
            )
            for row in self.plants
        ]

    def _laws(self, gains: Mapping[str, float]) -> Spectra:
        """Return both outputs per measured value at each airspeed, shape (speeds, F, 2, 3)."""
        z = np.exp(1j * self.frequency_radps * self.problem.roll.period_s)
        found = []
        for airspeed in self.problem.roll.airspeeds_mps:
            a, b, c, d = self.problem.law(gains, airspeed)
            left = z[:, None, None] * np.eye(len(a)) - a
            columns = np.broadcast_to(b.astype(complex), (len(z), *b.shape))
            found.append(c @ np.linalg.solve(left, columns) + d)
        return np.array(found)

    def loop(self, gains: Mapping[str, float]) -> Spectra:
        """Return the loop broken at both actuators, shape (speeds * N, F, 2, 2)."""
        law = self._laws(gains)[:, None]
        both = -law @ self._transfer[..., :BETA, :]
        return np.asarray(both.reshape(-1, *both.shape[2:]))

    def judged(self, gains: Mapping[str, float]) -> tuple[Margins, Margins, Array]:
        """Return margins at aileron and rudder, the other closed, and the joint disk of both."""
        found, w = self.loop(gains), self.frequency_radps
        across = found[..., 0, 1] * found[..., 1, 0]
        aileron = found[..., 0, 0] - across / (1.0 + found[..., 1, 1])
        rudder = found[..., 1, 1] - across / (1.0 + found[..., 0, 0])
        return margins(aileron, w), margins(rudder, w), joint_disk(found)

    def stable(self, gains: Mapping[str, float]) -> bool:
        """Return whether every closed loop is; a spiral may double in twenty seconds."""
        largest = math.exp(math.log(2.0) / SPIRAL_S * self.problem.roll.period_s)
        found = (np.max(np.abs(np.linalg.eigvals(a))) for a, _, _ in self._loops(gains))
        return all(float(one) < largest for one in found)

    def _loops(self, gains: Mapping[str, float]) -> Iterator[tuple[Array, Array, Array]]:
        """Return each airspeed's closed transitions, the demanded bank's input and outputs."""
        speeds = self.problem.roll.airspeeds_mps
        for airspeed, (a, b, c) in zip(speeds, self._stacked, strict=True):
            law = self.problem.law(gains, airspeed)
            # The demand enters the roll law as a bank does, with the other sign; the damper never.
            roll = self.problem.roll.structure.loop(self.problem.roll_gains, airspeed)
            _, rb, _, rd = state_space(roll)
            into, through = np.zeros((len(law[0]), 1)), np.zeros((2, 1))
            into[: len(rb), 0] = -rb[:, 0]
            through[:, 0] = -rd[0, 0] * np.array([1.0, self.problem.yaw.mix(gains)])
            entering = np.concatenate(
                [b @ through, np.broadcast_to(into, (len(a), *into.shape))], axis=1
            )
            yield closed(a, b, c[:, :BETA], law), entering, c

    def sideslip(self, gains: Mapping[str, float]) -> Array:
        """Return the rms sideslip over demanded bank in four seconds of a step, flat."""
        found = []
        for a, b, c in self._loops(gains):
            state, total = np.zeros((*a.shape[:-1], 1)), np.zeros(len(a))
            count = round(STEP_S / self.problem.roll.period_s)
            for _ in range(count):
                state = a @ state + b
                total += (c[:, BETA : BETA + 1] @ state[:, : c.shape[-1]])[:, 0, 0] ** 2
            found.append(np.sqrt(total / count))
        return np.concatenate(found)

    def yaw_in_gusts_radps(self, gains: Mapping[str, float]) -> tuple[Array, Array]:
        """Return rms yaw rate and rms rate of the rudder in side gusts of 1 m/s, flat."""
        w, law = self.frequency_radps, self._laws(gains)[:, None]
        moved = self.gusts[..., :BETA, None]
        around = self._transfer[..., :BETA, :] @ law
        seen = np.linalg.solve(np.eye(3) - around, moved)
        out = (law @ seen)[..., 1, 0]
        lag = 2.0 * math.pi * self.problem.rudder.bandwidth_hz
        surface = self.problem.rudder.travel_rad * 1j * w * lag / (1j * w + lag) * out
        power = self.gust_power[:, None]

        def rms(one: Spectra) -> Array:
            return np.asarray(np.sqrt(np.trapezoid(np.abs(one) ** 2 * power, w, axis=-1)).ravel())

        return rms(seen[..., R, 0]), rms(surface)


def draw_pair(problem: PairProblem, *, seed: int, count: int) -> PairScenarios:
    """Return aircraft drawn from the joint covariance and from both actuators'.

    Parameters
    ----------
    problem : PairProblem
    seed : int
        Another seed is another set of aircraft.
    count : int
    """
    roll = problem.roll
    rng = np.random.default_rng([seed, 49])
    values = roll.axis.drawn(rng, count)
    drives = np.stack([roll.actuator.drawn(rng, count), problem.rudder.drawn(rng, count)], axis=1)
    w = np.geomspace(SLOWEST_RADPS, 0.98 * np.pi / roll.period_s, POINTS)
    plants, gusts, powers = [], [], []
    for airspeed in roll.airspeeds_mps:
        row, blown = [], []
        for one, drive in zip(values, drives, strict=True):
            a, b, states = roll.axis.matrices(one, airspeed)
            senses = roll.axis.sense, problem.sense
            system = pair_system(
                (a, b, states), drive[:, :2], senses, roll.structure.gyro_filter_hz
            )
            # One output stage: both surfaces wait as long.
            row.append(sampled(system, float(drive[0, 2]), roll.period_s))
            (column, power), *_ = gust_inputs("yaw", a, states, airspeed, roll.span_m, w)
            left = 1j * w[:, None, None] * np.eye(len(system[0])) - system[0]
            into = np.zeros((len(w), len(system[0]), 1), dtype=complex)
            into[:, : len(column)] = column
            blown.append((system[2] @ np.linalg.solve(left, into))[..., 0])
        plants.append(tuple(row))
        gusts.append(blown)
        powers.append(power)
    return PairScenarios(problem, w, tuple(plants), np.array(gusts), np.array(powers))


def pair_system(
    dynamics: tuple[Array, Array, tuple[str, ...]],
    drives: Array,
    senses: tuple[float, float],
    gyro_filter_hz: float,
) -> tuple[Array, Array, Array]:
    """Return A, B, C from two shares of travel to bank, filtered p and r, and sideslip.

    Parameters
    ----------
    dynamics : tuple
        A, B of aileron and rudder, and the names of the states, ``beta_rad`` among them.
    drives : Array, shape (2, 2)
        Travel (rad) and bandwidth (Hz) of either servo.
    senses : tuple of float
        1 or -1: sign of either surface's moment.
    gyro_filter_hz : float
    """
    a, b, states = dynamics
    n = len(states)
    total = n + 2 + 4
    full, into, out = np.zeros((total, total)), np.zeros((total, 2)), np.zeros((4, total))
    full[:n, :n] = a
    for k, ((travel_rad, bandwidth_hz), sense) in enumerate(zip(drives, senses, strict=True)):
        lag = 2.0 * math.pi * bandwidth_hz
        full[:n, n + k] = b[:, k] * sense
        full[n + k, n + k] = -lag
        into[n + k, k] = lag * travel_rad
    corner = 2.0 * math.pi * gyro_filter_hz
    for k, (row, rate) in enumerate(((P, "p_radps"), (R, "r_radps"))):
        low = n + 2 + 2 * k
        full[low, low + 1] = 1.0
        full[low + 1, [states.index(rate), low, low + 1]] = (
            corner**2, -(corner**2), -math.sqrt(2.0) * corner
        )  # fmt: skip
        out[row, low] = 1.0
    out[PHI, states.index("phi_rad")] = 1.0
    out[BETA, states.index("beta_rad")] = 1.0
    return full, into, out
