"""Records that a pilot flies by hand, with test inputs at known times: the twin, and two of JSBSim.

A pilot holds altitude and heading in gusts, turns and climbs; what he does has a hand's lag and a
hand's trembling. A test input is flown over his held stick, its edges as long as a hand takes, then
he leaves the stick alone for some seconds. Surfaces come out as a pot measures them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from host.aircraft import file as aircraft
from host.aircraft.airframe import ROTOR
from host.aircraft.attitude import euler
from host.aircraft.rigid_body import run
from host.aircraft.trim import solve
from host.arrays import Array

STEP_S = 0.05  # of the pilot
SURFACES = ("elevator_rad", "aileron_rad", "rudder_rad")
HAND_S = (0.2, 0.5)  # an edge by hand
LEVEL_S, ALONE_S = 8.0, 6.0  # wings level before an input, hands off behind it
LAG_S, GUST_S = 0.25, 1.5  # of a hand; how long a gust lasts
ROLL_IN_RADPS = 0.12  # into a turn
LEFT_ALONE_RAD = 0.015  # a hand does not correct less
POT_RAD = math.radians(0.05)
M_PER_FT = 0.3048


@dataclass(frozen=True)
class FlownByHand:
    """What was flown: surface, first and last motion, s."""

    axis: str
    kind: str
    start_s: float
    end_s: float


class Aircraft(Protocol):
    """An aircraft in trim that moves on by one step of the pilot; sizes are those of inputs."""

    sizes_deg: dict[str, tuple[float, float]]

    def step(self, deflections_rad: Array, gust_mps: Array) -> dict[str, float]:
        """Move surfaces away from trim, fly on; return what the pilot sees."""
        ...


class Twin:
    """The package's own rigid body, a trainer of 1.9 kg."""

    def __init__(self) -> None:
        self.sizes_deg = {
            "elevator_rad": (3.0, 6.0),
            "aileron_rad": (2.5, 4.0),
            "rudder_rad": (6.0, 12.0),
        }
        self.frame = aircraft.load("ultrastick25e").airframe()
        self.trim = solve(self.frame, 17.0)
        self.state = self.trim.state.copy()

    def step(self, deflections_rad: Array, gust_mps: Array) -> dict[str, float]:
        """Fly 50 ms."""
        command = self.trim.command.copy()
        command[:3] += deflections_rad
        air = np.zeros(9)
        air[3:6] = gust_mps
        steps = round(STEP_S / 1e-3)
        commands = np.tile(command, (steps, 1))
        states, _ = run(self.frame, self.state, commands, air, self.trim.density_kgpm3, 1e-3)
        self.state = states[-1]
        phi, theta, _ = (float(x[0]) for x in euler(self.state[6:10][None, :]))
        u, v, w, p, q, r = self.state[:6].tolist()
        speed = math.sqrt(u * u + v * v + w * w)
        at = self.state[ROTOR - 3 : ROTOR]
        return dict(zip(SURFACES, at.tolist(), strict=True)) | {
            "phi_rad": phi, "theta_rad": theta, "p_radps": p, "q_radps": q, "r_radps": r,
            "airspeed_mps": speed,
        }  # fmt: skip


class Jsbsim:
    """An aircraft of JSBSim's wheel."""

    def __init__(self, name: str, kts: float, altitude_ft: float) -> None:
        import jsbsim

        self.fdm = jsbsim.FGFDMExec(None)
        self.fdm.set_debug_level(0)
        self.fdm.load_model(name)
        self.fdm.set_dt(0.01)
        self.fdm["ic/h-sl-ft"], self.fdm["ic/vc-kts"] = altitude_ft, kts
        if not self.fdm.run_ic():
            raise RuntimeError(f"JSBSim does not start {name}")
        self.fdm["propulsion/set-running"] = -1
        self.fdm["simulation/do_simple_trim"] = 1
        self.trim = [self.fdm[f"fcs/{s}-cmd-norm"] for s in ("elevator", "aileron", "rudder")]
        light = name == "c172p"
        self.limits_rad = (0.4, 0.3, 0.28) if light else (0.3, 0.35, 0.35)
        self.sizes_deg = {
            "elevator_rad": (2.5, 5.0),
            "aileron_rad": (4.0, 8.0),
            "rudder_rad": (6.0, 12.0) if light else (6.0, 10.0),
        }

    def step(self, deflections_rad: Array, gust_mps: Array) -> dict[str, float]:
        """Fly 50 ms."""
        fdm = self.fdm
        for name, at, off, limit in zip(
            ("elevator", "aileron", "rudder"), self.trim, deflections_rad, self.limits_rad,
            strict=True,
        ):  # fmt: skip
            fdm[f"fcs/{name}-cmd-norm"] = at + off / limit
        for name, gust in zip(("north", "east", "down"), gust_mps, strict=True):
            fdm[f"atmosphere/gust-{name}-fps"] = gust / M_PER_FT
        for _ in range(round(STEP_S / 0.01)):
            fdm.run()
        return {
            "elevator_rad": fdm["fcs/elevator-pos-rad"],
            "aileron_rad": fdm["fcs/left-aileron-pos-rad"],
            "rudder_rad": fdm["fcs/rudder-pos-rad"],
            "phi_rad": fdm["attitude/phi-rad"],
            "theta_rad": fdm["attitude/theta-rad"],
            "p_radps": fdm["velocities/p-rad_sec"],
            "q_radps": fdm["velocities/q-rad_sec"],
            "r_radps": fdm["velocities/r-rad_sec"],
            "airspeed_mps": fdm["velocities/vt-fps"] * M_PER_FT,
        }


PLANES: dict[str, Callable[[], Aircraft]] = {
    "twin": Twin,
    "c172p": lambda: Jsbsim("c172p", 100.0, 4000.0),
    "737": lambda: Jsbsim("737", 250.0, 15000.0),
}


def steps_of(kind: str, rng: np.random.Generator) -> tuple[str, list[tuple[float, float]]]:
    """Return axis, and length (s) and height (shares of the size) of each step of an input."""
    unit_s, sign = float(rng.uniform(1.0, 3.0)), float(rng.choice([-1.0, 1.0]))
    short_s = min(unit_s, 2.0)
    shapes = {
        "elevator pulse": ("elevator_rad", [(short_s, 1.0)]),
        "elevator doublet": ("elevator_rad", [(unit_s, 1.0), (unit_s, -1.0)]),
        "phugoid": ("elevator_rad", [(unit_s, 1.0)]),
        "aileron doublet": ("aileron_rad", [(short_s, 1.0), (short_s, -1.0)]),
        "aileron step": ("aileron_rad", [(unit_s, 1.0)]),
        "dutch roll": ("rudder_rad", [(unit_s, 1.0), (unit_s, -1.0)]),
        "rudder multistep": ("rudder_rad", [(2.0, 1.0), (1.5, -1.0), (1.0, 1.0), (1.0, -1.0)]),
    }
    axis, shape = shapes[kind]
    return axis, [(length_s, sign * height) for length_s, height in shape]


KINDS = (
    "elevator pulse", "elevator doublet", "phugoid", "aileron doublet", "aileron step",
    "dutch roll", "rudder multistep",
)  # fmt: skip


def _hand(steps: Sequence[tuple[float, float]], edge_s: float) -> Array:
    """Return an input at the pilot's steps: edges are half a cosine long."""
    ends = np.cumsum([length for length, _ in steps])
    t = np.arange(0.0, float(ends[-1]) + edge_s + STEP_S, STEP_S)
    level = np.zeros(len(t))
    before = 0.0
    for begin, height in zip([0.0, *ends], [*(height for _, height in steps), 0.0], strict=True):
        share = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - begin) / edge_s, 0.0, 1.0))
        level += (height - before) * share
        before = height
    return level


def flown(
    plane: str, seed: int, *, inputs: int, length_s: float
) -> tuple[dict[str, Array], list[FlownByHand]]:
    """Return 20 Hz columns of one record and its test inputs.

    Parameters
    ----------
    plane : str
        One of `PLANES`.
    seed : int
    inputs : int
        As many, evenly spread; 0: handling alone.
    length_s : float
    """
    rng = np.random.default_rng([seed, sorted(PLANES).index(plane)])
    craft = PLANES[plane]()
    gust_mps = float(rng.choice([0.0, 0.3, 0.8]))
    script, truth = _script(craft, rng, inputs, length_s)
    pilot, gust = _Pilot(rng, 0.3 if plane == "737" else 0.25), np.zeros(3)
    seen = craft.step(np.zeros(3), gust)
    rows: list[dict[str, float]] = []
    for k in range(round(length_s / STEP_S)):
        t_s = k * STEP_S
        testing = any(one.prepared(t_s) for one in script)
        command = pilot.handling(t_s, seen, testing=testing)
        for one in script:
            one.over(t_s, command, pilot.stick_rad)
        gust += gust_mps * math.sqrt(2.0 * STEP_S / GUST_S) * rng.standard_normal(3)
        gust -= gust * STEP_S / GUST_S
        seen = craft.step(np.clip(command, -0.35, 0.35), gust)
        rows.append({"t_s": t_s} | seen)
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    for name in SURFACES:
        columns[name] += POT_RAD * rng.standard_normal(len(rows))
    return columns, truth


class _Pilot:
    """Turns and climbs at random times, by a stick with a hand's lag and trembling."""

    def __init__(self, rng: np.random.Generator, gain: float) -> None:
        self.rng, self.gain = rng, gain
        self.stick_rad, self.tremor_rad = np.zeros(3), np.zeros(3)
        self.bank_rad = self.goal_rad = self.climb_rad = 0.0
        self.theta_rad: float | None = None  # of trim
        self.next_s = float(rng.uniform(10.0, 30.0))

    def handling(self, t_s: float, seen: dict[str, float], *, testing: bool) -> Array:
        """Return where he holds the surfaces, level while a test input is `testing`."""
        if self.theta_rad is None:
            self.theta_rad = seen["theta_rad"]
        if t_s > self.next_s:
            self.goal_rad = float(self.rng.choice([0.0, 0.0, 0.3, -0.3, 0.5, -0.5]))
            self.climb_rad = float(self.rng.choice([0.0, 0.0, 0.08, -0.08]))
            self.next_s = t_s + float(self.rng.uniform(15.0, 45.0))
        goal, climb = (0.0, 0.0) if testing else (self.goal_rad, self.climb_rad)
        most = ROLL_IN_RADPS * STEP_S
        self.bank_rad += float(np.clip(goal - self.bank_rad, -most, most))
        off = np.array(
            [self.bank_rad - seen["phi_rad"], self.theta_rad + climb - seen["theta_rad"]]
        )
        off = np.where(np.abs(off) < LEFT_ALONE_RAD, 0.0, off)
        wanted = np.array(
            [
                -self.gain * off[1] + 0.15 * seen["q_radps"],
                self.gain * off[0] - 0.12 * seen["p_radps"],
                0.0,
            ]
        )
        self.tremor_rad += -self.tremor_rad * STEP_S / 0.5 + 0.0006 * self.rng.standard_normal(3)
        at = np.clip(wanted, -0.2, 0.2) + self.tremor_rad
        self.stick_rad += (at - self.stick_rad) * STEP_S / LAG_S
        return self.stick_rad.copy()


class _Input:
    """A test input over a stick that is held where it was."""

    def __init__(self, begin_s: float, axis: int, level_rad: Array) -> None:
        self.begin_s, self.axis, self.level_rad = begin_s, axis, level_rad
        self.end_s = begin_s + len(level_rad) * STEP_S
        self.held_rad: float | None = None

    def prepared(self, t_s: float) -> bool:
        """Whether the pilot has levelled for it."""
        return self.begin_s - LEVEL_S <= t_s < self.end_s + ALONE_S

    def over(self, t_s: float, command: Array, stick_rad: Array) -> None:
        """Write the input, and then the held stick, into a command."""
        place = round((t_s - self.begin_s) / STEP_S)
        if place < 0 or t_s >= self.end_s + ALONE_S:
            return
        if self.held_rad is None:
            self.held_rad = float(stick_rad[self.axis])
        stick_rad[self.axis] = self.held_rad
        moved = float(self.level_rad[place]) if place < len(self.level_rad) else 0.0
        command[self.axis] = self.held_rad + moved


def _script(
    craft: Aircraft, rng: np.random.Generator, inputs: int, length_s: float
) -> tuple[list[_Input], list[FlownByHand]]:
    script, truth = [], []
    order = rng.permutation(len(KINDS))
    room_s = (length_s - 30.0) / max(inputs, 1)
    for number in range(inputs):
        kind = KINDS[order[number % len(KINDS)]]
        axis, steps = steps_of(kind, rng)
        low, high = craft.sizes_deg[axis]
        size = 8.0 if kind == "rudder multistep" else float(rng.uniform(low, high))
        edge_s = float(rng.uniform(*HAND_S))
        level = math.radians(size) * _hand(steps, edge_s)
        begin = round((20.0 + number * room_s + float(rng.uniform(0.0, 5.0))) / STEP_S) * STEP_S
        script.append(_Input(begin, SURFACES.index(axis), level))
        truth.append(FlownByHand(axis, kind, begin, begin + sum(s for s, _ in steps) + edge_s))
    return script, truth


def decimated(columns: dict[str, Array], rate_hz: float) -> dict[str, Array]:
    """Return every n-th row."""
    every = round(1.0 / STEP_S / rate_hz)
    return {name: values[::every] for name, values in columns.items()}
