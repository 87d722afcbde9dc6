"""Aircraft drawn from what is not known, each at each airspeed, as sampled plants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from host.arrays import Array
from host.control.actuator import Actuator
from host.control.autopilots.structure import Loop, Structure, state_space
from host.control.disturbances import gust_inputs
from host.control.margins import Margins, Spectra, margins
from host.control.plant import Plant, continuous, sampled
from host.control.uncertain_axis import UncertainAxis

POINTS = 160  # frequencies; 40 000 move a margin by less than 0.01 dB and 0.05 degrees
SLOWEST_RADPS = 0.05  # one turn in two minutes
SLEW_FILTER_RADPS = 2.0 * np.pi * 25.0  # ArduPlane's Filter/SlewLimiter.cpp


@dataclass(frozen=True)
class Problem:
    """What gains are looked for, and what is known of it.

    Attributes
    ----------
    axis : UncertainAxis
    actuator : Actuator
    structure : Structure
        Structure of the autopilot: its rate and gyro filter are in the loop.
    airspeeds_mps : tuple of float
    span_m : float
        0 where nobody measured it: then no gust rolls the aircraft.
    gyro_noise_radps : float
    """

    axis: UncertainAxis
    actuator: Actuator
    structure: Structure
    airspeeds_mps: tuple[float, ...]
    span_m: float = 0.0
    gyro_noise_radps: float = 0.0

    @property
    def period_s(self) -> float:
        """Period of the autopilot's loop."""
        usual = {role: one.default for role, one in self.structure.settings.items()}
        return self.structure.loop(usual, self.airspeeds_mps[0]).period_s


@dataclass(frozen=True)
class Scenario:
    """One aircraft at one airspeed.

    Attributes
    ----------
    plant : Plant
    response : Array, shape (F, 2)
        Angle and rate per share of travel.
    gusts : tuple of (Array, Array)
        Angle and rate per gust, shape (F, 2), and its spectrum.
    surface : Array, shape (F,)
        Rate of the surface (rad/s) per share of travel demanded.
    """

    plant: Plant
    response: Spectra
    gusts: tuple[tuple[Spectra, Array], ...]
    surface: Spectra


@dataclass(frozen=True)
class Scenarios:
    """Aircraft of one drawing, speed by speed."""

    problem: Problem
    frequency_radps: Array
    of_speed: tuple[tuple[Scenario, ...], ...]

    def loops(self, gains: Mapping[str, float]) -> tuple[Spectra, Spectra]:
        """Return the loop broken at the actuator and the attitude loop, each (speeds * N, F)."""
        return self._broken(*self._laws(gains))

    def _broken(self, by_angle: Spectra, by_rate: Spectra) -> tuple[Spectra, Spectra]:
        # Measured values enter with a minus: L is what comes back, turned.
        angle = -by_angle[:, None] * self.responses[..., 0]
        rate = -by_rate[:, None] * self.responses[..., 1]
        shape = (-1, len(self.frequency_radps))
        return (angle + rate).reshape(shape), (angle / (1.0 + rate)).reshape(shape)

    def _laws(self, gains: Mapping[str, float]) -> tuple[Spectra, Spectra]:
        """Return the loop's output per angle and per rate at each airspeed, (speeds, F) each."""
        structure, speeds = self.problem.structure, self.problem.airspeeds_mps
        found = [law_response(structure.loop(gains, v), self.frequency_radps) for v in speeds]
        return np.array([one for one, _ in found]), np.array([one for _, one in found])

    @cached_property
    def responses(self) -> Spectra:
        """Angle and rate per share of travel, shape (speeds, N, F, 2)."""
        return np.array([[one.response for one in row] for row in self.of_speed])

    def judged(self, gains: Mapping[str, float]) -> tuple[Margins, Margins]:
        """Return the margins at the actuator and of the attitude loop."""
        inner, outer = self.loops(gains)
        return margins(inner, self.frequency_radps), margins(outer, self.frequency_radps)

    def stable(self, gains: Mapping[str, float]) -> Array:
        """Return whether each closed loop is stable, shape (speeds * N,)."""
        found = [np.max(np.abs(np.linalg.eigvals(a)), axis=-1) < 1.0 for a, _ in self._loops(gains)]
        return np.concatenate(found)

    def poles(self, gains: Mapping[str, float]) -> Spectra:
        """Return the closed loops' poles as those of continuous time, 1/s, flat."""
        z = np.concatenate([np.linalg.eigvals(a).ravel() for a, _ in self._loops(gains)])
        z = z.astype(complex)
        return np.asarray(np.log(z[np.abs(z) > 0.0]) / self.problem.period_s)

    def steps(self, gains: Mapping[str, float], seconds: float) -> tuple[Array, Array]:
        """Return time (T,) and angle over the demanded one (speeds * N, T) behind a step of it."""
        count = round(seconds / self.problem.period_s)
        found = []
        for (a, b), (_, _, c) in zip(self._loops(gains), self._plants, strict=True):
            state = np.zeros((*a.shape[:-1], 1))
            angle = np.empty((len(a), count))
            for k in range(count):
                angle[:, k] = (c[:, :1] @ state[:, : c.shape[-1]])[:, 0, 0]
                state = a @ state + b
            found.append(angle)
        return self.problem.period_s * np.arange(count), np.concatenate(found)

    def _loops(self, gains: Mapping[str, float]) -> Iterator[tuple[Array, Array]]:
        """Return transitions and the demand's input of each airspeed's closed loops."""
        for airspeed, (a, b, c) in zip(self.problem.airspeeds_mps, self._plants, strict=True):
            law = state_space(self.problem.structure.loop(gains, airspeed))
            # A demanded angle enters the law as a measured one does, with the other sign.
            _, lb, _, ld = law
            into = np.concatenate(
                [-b * ld[0, 0], np.broadcast_to(-lb[:, :1], (len(a), len(lb), 1))], axis=1
            )
            yield closed(a, b, c, law), into

    @cached_property
    def _plants(self) -> list[tuple[Array, Array, Array]]:
        """A, B, C of each airspeed's aircraft, stacked; those of shorter delay with idle states."""
        size = max(len(one.plant.a) for row in self.of_speed for one in row)
        return [
            (
                np.stack([padded(one.plant.a, size, size) for one in row]),
                np.stack([padded(one.plant.b, size, 1) for one in row]),
                np.stack([padded(one.plant.c, 2, size) for one in row]),
            )
            for row in self.of_speed
        ]

    @cached_property
    def _surfaces(self) -> Spectra:
        return np.array([[one.surface for one in row] for row in self.of_speed])

    @cached_property
    def _gusts(self) -> list[tuple[Spectra, Array]]:
        """Angle and rate per gust, shape (speeds, N, F, 2), and its spectra, shape (speeds, F)."""
        return [
            (
                np.array([[one.gusts[k][0] for one in row] for row in self.of_speed]),
                np.array([row[0].gusts[k][1] for row in self.of_speed]),
            )
            for k in range(len(self.of_speed[0][0].gusts))
        ]

    def moving(self, gains: Mapping[str, float]) -> tuple[Array, Array]:
        """Return rms rates in gusts of 1 m/s with the gyro's noise, flat.

        First the surface's, rad/s, then the output's as a slew limiter sees it, shares of travel
        per second.
        """
        w, power = self.frequency_radps, self._output_power(gains)
        s = 1j * w
        filtered = s / (1.0 + s / SLEW_FILTER_RADPS)

        def rms(per_output: Spectra) -> Array:
            found = np.trapezoid(np.abs(per_output) ** 2 * power, w, axis=-1)
            return np.asarray(np.sqrt(found).ravel())

        return rms(self._surfaces), rms(filtered)

    def _output_power(self, gains: Mapping[str, float]) -> Array:
        """Return the output's spectrum in gusts and by noise, shares^2 s, (speeds, N, F)."""
        period = self.problem.period_s
        by_angle, by_rate = self._laws(gains)
        inner, _ = self._broken(by_angle, by_rate)
        closes = 1.0 / (1.0 + inner.reshape(self._surfaces.shape))
        white = self.problem.gyro_noise_radps**2 * period / np.pi
        power = np.abs(by_rate[:, None]) ** 2 * white
        for moved, spectrum in self._gusts:
            seen = by_angle[:, None] * moved[..., 0] + by_rate[:, None] * moved[..., 1]
            power = power + np.abs(seen) ** 2 * spectrum[:, None]
        return np.asarray(np.abs(closes) ** 2 * power)


def draw(problem: Problem, *, seed: int, count: int) -> Scenarios:
    """Return aircraft drawn from the joint covariance of the answer and from the actuator's.

    Parameters
    ----------
    problem : Problem
    seed : int
        Another seed is another set of aircraft.
    count : int
    """
    rng = np.random.default_rng([seed, 48])
    return scenarios_of(problem, problem.axis.drawn(rng, count), problem.actuator.drawn(rng, count))


def scenarios_of(problem: Problem, values: Array, drives: Array) -> Scenarios:
    """Return named aircraft at each airspeed.

    Parameters
    ----------
    problem : Problem
    values : Array, shape (N, P)
        Derivatives at the airspeed of the trim.
    drives : Array, shape (N, 3)
        Travel (rad), bandwidth (Hz) and delay (s).
    """
    period = problem.period_s
    w = np.geomspace(SLOWEST_RADPS, 0.98 * np.pi / period, POINTS)
    rows = tuple(
        tuple(
            _scenario(problem, one, drive, airspeed, w)
            for one, drive in zip(values, drives, strict=True)
        )
        for airspeed in problem.airspeeds_mps
    )
    return Scenarios(problem, w, rows)


def _scenario(
    problem: Problem, values: Array, drive: Array, airspeed_mps: float, w: Array
) -> Scenario:
    travel_rad, bandwidth_hz, delay_s = drive.tolist()
    axis, dynamics = problem.axis.axis, problem.axis.matrices(values, airspeed_mps)
    filter_hz, sense = problem.structure.gyro_filter_hz, problem.axis.sense
    system = continuous(axis, dynamics, travel_rad, bandwidth_hz, filter_hz, sense)
    plant = sampled(system, delay_s, problem.period_s)
    a, _, c = system
    left = 1j * w[:, None, None] * np.eye(len(a)) - a
    found = gust_inputs(axis, dynamics[0], dynamics[2], airspeed_mps, problem.span_m, w)
    into = np.zeros((len(a), len(found)), dtype=complex)
    for k, (column, _) in enumerate(found):
        into[: len(column), k] = column[:, 0]
    moved = c @ np.linalg.solve(left, into)
    gusts = [(moved[..., k], spectrum) for k, (_, spectrum) in enumerate(found)]
    lag = 2.0 * np.pi * bandwidth_hz
    surface = travel_rad * 1j * w * lag / (1j * w + lag)
    return Scenario(plant, plant.response(w), tuple(gusts), surface)


def law_response(loop: Loop, frequency_radps: Array) -> tuple[Spectra, Spectra]:
    """Return the loop's output per measured angle and per measured rate, each of shape (F,)."""
    a, b, c, d = state_space(loop)
    z = np.exp(1j * frequency_radps * loop.period_s)
    left = z[:, None, None] * np.eye(len(a)) - a
    column = np.broadcast_to(b.astype(complex), (len(z), *b.shape))
    found = np.asarray(c @ np.linalg.solve(left, column) + d, dtype=np.complex128)
    return found[:, 0, 0], found[:, 0, 1]


def closed(a: Array, b: Array, c: Array, law: tuple[Array, Array, Array, Array]) -> Array:
    """Return the transitions of plants and loop together; a plant's output has no direct part.

    Parameters
    ----------
    a, b, c : Array, shapes (N, n, n), (N, n, 1), (N, 2, n)
    law : tuple of Array
        A, B, C, D of the loop.
    """
    la, lb, lc, ld = law
    n, count = a.shape[-1], len(a)
    full = np.zeros((count, n + len(la), n + len(la)))
    full[:, :n, :n] = a + b @ ld @ c
    full[:, :n, n:] = b @ lc
    full[:, n:, :n] = lb @ c
    full[:, n:, n:] = la
    return full


def padded(matrix: Array, rows: int, columns: int) -> Array:
    wide = np.zeros((rows, columns))
    wide[: matrix.shape[0], : matrix.shape[1]] = matrix
    return wide
