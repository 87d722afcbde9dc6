"""Path and height loops around tuned gains: checked at their own command, not tuned.

Path: ArduPlane's L1 (AP_L1_Control.cpp, 4.7-dev) and PX4's NPFG (npfg.cpp) near a straight path are
one law: with w = 2 pi / period the bank asked is -(w^2 y + 2 zeta w y') / g. L1 adds an integral
(NAVL1_XTRACK_I).
Height: TECS as far as pitch goes, of ArduPlane (AP_TECS.cpp, 4.7-dev; height and speed weighed
alike) and of PX4 (src/lib/tecs/TECS.cpp, main 00d281a). The throttle stays: an answer has no
thrust. INAV's nav_fw is not looked at.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2
from host.control.autopilots import parameter_table
from host.control.margins import Spectra, margins
from host.control.scenarios import Problem, Scenarios, draw, law_response
from host.control.verification import UNSEEN, Required

UPDATE_S = 0.1  # ArduPlane navigates at 10 Hz (SCHED_TASK navigate, update_alt); PX4 no slower
SLOWEST_RADPS, FASTEST_RADPS, POINTS = 1e-3, 20.0, 500  # slower than its integrals; beyond all use


@dataclass(frozen=True)
class OuterLoop:
    """One outer loop with the parameters that a log names.

    Attributes
    ----------
    title : str
    axis : str
        Axis of the attitude that it asks for.
    parameters : mapping of str to float
        By name, with defaults where the log has none.
    loop : callable
        From (speed, frequency, responses by name) to the loop at its own command.
    """

    title: str
    axis: str
    parameters: Mapping[str, float]
    loop: Callable[[float, Array, Mapping[str, Spectra]], Spectra]


@dataclass(frozen=True, slots=True)
class OuterCheck:
    """What unseen aircraft say of an outer loop: worst margins, and whether every one is stable."""

    title: str
    gain_db: float
    phase_deg: float
    stable: bool
    parameters: Mapping[str, float]

    @property
    def line(self) -> str:
        """A line of its margins and parameters."""
        named = ", ".join(f"{name} {value:g}" for name, value in self.parameters.items())
        required = Required()
        if not self.stable:
            return f"{self.title}: unstable in some of {UNSEEN} aircraft; slow it down: {named}"
        kept = self.gain_db >= required.gain_db and self.phase_deg >= required.phase_deg
        found = f"{self.title}: at least {self.gain_db:.1f} dB, {self.phase_deg:.0f} deg"
        return f"{found}{'' if kept else '; slow it down'}: {named}"


def check(outer: OuterLoop, problem: Problem, gains: Mapping[str, float], seed: int) -> OuterCheck:
    """Return the worst of an outer loop over aircraft that no step has seen.

    Parameters
    ----------
    outer : OuterLoop
    problem : Problem
        Problem of the attitude that it asks for.
    gains : mapping of str to float
        Tuned, by role.
    seed : int
    """
    w = np.geomspace(SLOWEST_RADPS, FASTEST_RADPS, POINTS)
    w = w[w < 0.98 * np.pi / problem.period_s]
    unseen = draw(problem, seed=seed, count=UNSEEN)
    found = np.concatenate([
        outer.loop(speed, w, states) for speed, states in _states_per_demand(unseen, gains, w)
    ])  # fmt: skip
    worst = margins(found * _held(w), w)
    return OuterCheck(
        outer.title,
        float(np.min(worst.gain_db)),
        float(np.min(worst.phase_deg)),
        bool(np.all(encircles_nothing(found * _held(w), w))),
        outer.parameters,
    )


def encircles_nothing(loop: Spectra, w: Array) -> Array:
    """Return whether 1 + L of loops that are stable when open turns by no half turn, shape (N,).

    Nyquist's criterion; up to three integrators in L are taken out of 1 + L, where they are poles.
    """
    s = 1j * w
    turned = np.unwrap(np.angle((1.0 + loop) * (s / (s + 1.0)) ** 3), axis=-1)
    # The angle of a stable loop starts at the quarter turns that its integrators left of the three,
    # and unwinds to none at high frequency.
    slope = np.log(np.abs(loop[:, 1] / loop[:, 0])) / np.log(w[1] / w[0])
    left = 3.0 + np.round(slope)
    return np.asarray(np.abs(turned[:, -1] - turned[:, 0] + left * np.pi / 2.0) < np.pi / 2.0)


def _held(w: Array) -> Spectra:
    """Return a value that is held from update to update, and half of it late by the task's turn."""
    s = 1j * w * UPDATE_S
    return np.asarray((1.0 - np.exp(-s)) / s)


def _states_per_demand(
    seen: Scenarios, gains: Mapping[str, float], w: Array
) -> Iterator[tuple[float, dict[str, Spectra]]]:
    """Yield each airspeed with states and angle per demanded angle, of each shape (N, F)."""
    problem = seen.problem
    _, _, names = problem.axis.matrices(problem.axis.mean, problem.axis.trim.airspeed_mps)
    for airspeed, row in zip(problem.airspeeds_mps, seen.of_speed, strict=True):
        by_angle, by_rate = law_response(problem.structure.loop(gains, airspeed), w)
        both: dict[str, list[Spectra]] = {name: [] for name in (*names, "angle")}
        for one in row:
            z = np.exp(1j * w * one.plant.period_s)
            left = z[:, None, None] * np.eye(len(one.plant.a)) - one.plant.a
            column = np.broadcast_to(one.plant.b.astype(complex), (len(w), *one.plant.b.shape))
            state = np.linalg.solve(left, column)
            angle, rate = (one.plant.c @ state)[..., 0].T
            # A demand enters as an angle does, with the other sign.
            driven = -by_angle / (1.0 - by_angle * angle - by_rate * rate)
            for k, name in enumerate(names):
                both[name].append(driven * state[:, k, 0])
            both["angle"].append(driven * angle)
        yield airspeed, {name: np.array(kept) for name, kept in both.items()}


def path_loop(
    period_s: float, damping: float, integral: float
) -> Callable[[float, Array, Mapping[str, Spectra]], Spectra]:
    """Return the loop at the demanded bank near a straight path, in coordinated turns."""
    wanted = 2.0 * math.pi / period_s

    def loop(speed_mps: float, w: Array, per_demand: Mapping[str, Spectra]) -> Spectra:
        s = 1j * w
        law = wanted**2 * (1.0 + integral / s) + 2.0 * damping * wanted * s
        return np.asarray(per_demand["angle"] * law / s**2)

    return loop


def height_loop(
    time_constant_s: float, damping: float, integral: float
) -> Callable[[float, Array, Mapping[str, Spectra]], Spectra]:
    """Return TECS' loop at the demanded pitch, throttle at rest.

    With E = g h - V v of height h and speed error v: the pitch asked is that of (1 + d) E / T + d
    E' + I integral(E / T + E') - integral(V v) / T, over V g. What counts of v' is what is faster
    than T.
    """
    t = time_constant_s

    def loop(speed_mps: float, w: Array, per_demand: Mapping[str, Spectra]) -> Spectra:
        s = 1j * w
        climb = speed_mps * (per_demand["theta_rad"] - per_demand["alpha_rad"])
        speed = speed_mps * per_demand["airspeed_mps"]
        balance = GRAVITY_MPS2 * climb / s - speed
        slope = GRAVITY_MPS2 * climb - speed * s * (s * t / (1.0 + s * t))
        asked = (1.0 + damping) * balance / t + damping * slope
        asked = asked + integral / s * (balance / t + slope) - speed / (s * t)
        return np.asarray(asked / (speed_mps * GRAVITY_MPS2))

    return loop


def px4_height_loop(
    tuned: Mapping[str, float], filtered: Mapping[str, float]
) -> Callable[[float, Array, Mapping[str, Spectra]], Spectra]:
    """Return PX4's TECS at the demanded pitch, throttle at rest.

    Height and speed errors ask a rate of g h' - V v'; its error, its integral and the rate asked
    make the pitch, over V g. Speed and its rate are behind a filter of two states.

    Parameters
    ----------
    tuned, filtered : mapping of str to float
        ``FW_T_*`` of the law and of the airspeed's filter.
    """
    height_s, speed_s, damping, integral, ahead, weight = tuned.values()
    at_height, at_speed = np.clip([2.0 - weight, weight], 0.0, 1.0).tolist()
    (k00, k01), (k10, k11) = airspeed_gains(*filtered.values())

    def loop(speed_mps: float, w: Array, per_demand: Mapping[str, Spectra]) -> Spectra:
        s = 1j * w
        climb = speed_mps * (per_demand["theta_rad"] - per_demand["alpha_rad"])
        both = (s + k00) * (s + k11) - k10 * (k01 - 1.0)
        kept = ((k00 + k01 * s) * (s + k11) - (k01 - 1.0) * (k10 + k11 * s)) / both
        slope = ((s + k00) * (k10 + k11 * s) - k10 * (k00 + k01 * s)) / both
        speed, faster = kept * per_demand["airspeed_mps"], slope * per_demand["airspeed_mps"]
        potential, kinetic = at_height * GRAVITY_MPS2, at_speed * speed_mps
        asked = potential * climb / (s * height_s) - kinetic * speed / speed_s
        error = asked + potential * climb - kinetic * faster
        pitch = error * (damping + integral / s) + ahead * asked
        return np.asarray(pitch / (speed_mps * GRAVITY_MPS2))

    return loop


def airspeed_gains(speed_sd: float, rate_sd: float, process_sd: float) -> Array:
    """Return the gains of a steady Kalman filter of speed and rate, as TECS.cpp solves it."""
    seen, noisy = 1.0 / speed_sd, process_sd / rate_sd**2
    root = math.sqrt(process_sd * (2.0 * seen + noisy))
    gains = [[seen * root, noisy], [seen**2 * process_sd, noisy * root]]
    return np.array(gains) / (seen + noisy)


def arduplane_loops(logged: Mapping[str, float]) -> tuple[OuterLoop, ...]:
    """Return L1 and TECS' pitch with the parameters of a log, defaults where it has none."""
    path = parameter_table.named("ardupilot", "path", logged)
    height = parameter_table.named("ardupilot", "height", logged)
    return (
        OuterLoop("path (L1)", "roll", path, path_loop(*path.values())),
        OuterLoop("height by pitch (TECS)", "pitch", height, height_loop(*height.values())),
    )


def px4_loops(logged: Mapping[str, float]) -> tuple[OuterLoop, ...]:
    """Return NPFG, its period no shorter than it lets it be, and TECS' pitch, as a log has them."""
    path = parameter_table.named("px4", "path", logged)
    period, damping, roll_s = path.values()
    law = path_loop(max(period, math.pi * roll_s / damping), damping, 0.0)
    height = parameter_table.named("px4", "height", logged)
    filtered = parameter_table.named("px4", "airspeed_filter", logged)
    return (
        OuterLoop("path (NPFG)", "roll", path, law),
        OuterLoop("height by pitch (TECS)", "pitch", height, px4_height_loop(height, filtered)),
    )
