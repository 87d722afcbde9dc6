"""Gains for two aircraft of JSBSim's wheel: flown there, identified, tuned, flown again there.

    python -m studies.jsbsim_gains

A light aircraft and a supersonic trainer. Surfaces count in shares of full command: what the record
has is what the law drives, so no angle is needed. The law is the logger's hold (angle, integral and
rate gains), the only one of ours in units that do not name a model aircraft.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pandas as pd
from host.arrays import Array
from host.control.actuator import PULSE_PERIOD_S, Actuator
from host.control.autopilots.mega import Mega, structure
from host.control.autopilots.structure import Setting
from host.control.loop_design import Design, design
from host.control.margins import Margins, margins
from host.control.scenarios import Problem, draw
from host.control.uncertain_axis import UncertainAxis, axes_of
from host.sysid.pipeline import identify
from scipy.signal import butter, lfilter

from studies.study_table import Table, markdown

M_PER_FT = 0.3048
STEP_S = 0.005  # of the law; twice what JSBSim is flown with
RECORD_HZ = 50
SERVO_HZ, SERVO_RADPS = 8.0, 5.0  # put between law and command
SURFACES = {"roll": "aileron", "pitch": "elevator"}
ANGLES = {"roll": "phi_rad", "pitch": "theta_rad"}
RATES = {"roll": "p_radps", "pitch": "q_radps"}
Tuned = Mapping[str, tuple[Problem, Mapping[str, float]]]
STEPS_RAD = {"roll": math.radians(15.0), "pitch": math.radians(4.0)}
NOISE = {
    "p_radps": 0.002, "q_radps": 0.002, "r_radps": 0.002, "phi_rad": 0.005, "theta_rad": 0.005,
    "airspeed_mps": 0.3, "alpha_rad": 0.005, "beta_rad": 0.005,
    "ax_mps2": 0.05, "ay_mps2": 0.05, "az_mps2": 0.05,
}  # fmt: skip
PERIOD_S = 20.0
HARMONICS = np.unique(np.round(np.geomspace(0.05, 12.0, 40) * PERIOD_S / 2.0) * 2.0 + 1.0)
LARGEST = 0.02  # of full command, all sines together
COLUMNS = ("aircraft, axis", "gains deg/deg, deg/(deg s), deg/(deg/s)", "worst of 135 dB, deg",
           "computed dB, deg", "measured dB, deg", "rise s", "overshoot %")  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One aircraft of the wheel, where it flies, and the size of its inputs."""

    name: str
    kts: float
    altitude_ft: float
    sizes: Mapping[str, float]


CASES = (
    Case("c172p", 100.0, 4000.0, {"elevator": 0.10, "aileron": 0.15, "rudder": 0.25}),
    Case("T38", 300.0, 10000.0, {"elevator": 0.05, "aileron": 0.05, "rudder": 0.15}),
)


class Craft:
    """An aircraft of JSBSim in trim, driven by shares of command about it."""

    def __init__(self, case: Case) -> None:
        import jsbsim

        fdm = jsbsim.FGFDMExec(None)
        fdm.set_debug_level(0)
        fdm.load_model(case.name)
        fdm.set_dt(0.5 * STEP_S)
        fdm["ic/h-sl-ft"], fdm["ic/vc-kts"] = case.altitude_ft, case.kts
        if not fdm.run_ic():
            raise RuntimeError(f"JSBSim does not start {case.name}")
        fdm["propulsion/set-running"] = -1
        fdm["simulation/do_simple_trim"] = 1
        self.fdm = fdm
        self.trim = {s: fdm[f"fcs/{s}-cmd-norm"] for s in case.sizes}

    def step(self, command: Mapping[str, float]) -> None:
        """Fly one step of the law."""
        for name, at in self.trim.items():
            self.fdm[f"fcs/{name}-cmd-norm"] = at + command.get(name, 0.0)
        self.fdm.run()
        self.fdm.run()

    def seen(self) -> dict[str, float]:
        """Return what sensors would, without error."""
        f = self.fdm
        return {
            "p_radps": f["velocities/p-rad_sec"], "q_radps": f["velocities/q-rad_sec"],
            "r_radps": f["velocities/r-rad_sec"], "phi_rad": f["attitude/phi-rad"],
            "theta_rad": f["attitude/theta-rad"],
            "airspeed_mps": f["velocities/vt-fps"] * M_PER_FT,
            "alpha_rad": f["aero/alpha-rad"], "beta_rad": f["aero/beta-rad"],
            "ax_mps2": f["accelerations/a-pilot-x-ft_sec2"] * M_PER_FT,
            "ay_mps2": f["accelerations/a-pilot-y-ft_sec2"] * M_PER_FT,
            "az_mps2": f["accelerations/a-pilot-z-ft_sec2"] * M_PER_FT,
        }  # fmt: skip


def record(case: Case, seed: int) -> dict[str, Array]:
    """Return 50 Hz columns of 3-2-1-1 of each surface, twice, a wing leveller flying between."""
    craft, rng = Craft(case), np.random.default_rng(seed)
    unit_s = {"elevator": 0.5, "aileron": 0.3, "rudder": 0.7}
    plan: list[tuple[float, str, float]] = []
    at_s = 5.0
    for _ in range(2):
        for name, size in case.sizes.items():
            for sign, units in ((1, 3), (-1, 2), (1, 1), (-1, 1)):
                plan.append((at_s, name, sign * size))
                at_s += units * unit_s[name]
            plan.append((at_s, name, 0.0))
            at_s += 6.0
            plan.append((at_s, "hands on", 1.0))
            at_s += 8.0
            plan.append((at_s, "hands on", 0.0))
            at_s += 2.0
    command = dict.fromkeys((*case.sizes, "hands on"), 0.0)
    level = craft.seen()["theta_rad"]
    rows: list[dict[str, float]] = []
    for k in range(round(at_s / STEP_S)):
        while plan and k * STEP_S >= plan[0][0]:
            _, name, value = plan.pop(0)
            command[name] = value
        seen = craft.seen()
        flown = {name: command[name] for name in case.sizes}
        if command["hands on"]:
            flown["aileron"] -= 0.15 * seen["phi_rad"] + 0.05 * seen["p_radps"]
            flown["elevator"] += 0.15 * (seen["theta_rad"] - level) + 0.05 * seen["q_radps"]
        if k % round(1.0 / RECORD_HZ / STEP_S) == 0:
            rows.append({"t_s": k * STEP_S, **{f"{n}_rad": v for n, v in flown.items()}, **seen})
        craft.step(flown)
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    for name, sd in NOISE.items():
        columns[name] += sd * rng.standard_normal(len(rows))
    return columns


class Hold(Mega):
    """The hold without the ranges of a model aircraft's gains."""

    @property
    def settings(self) -> Mapping[str, Setting]:
        """Gains that are tuned, to ten times as large."""
        return {role: replace(one, highest=10.0 * one.highest)
                for role, one in super().settings.items()}  # fmt: skip


def problem_of(axis: UncertainAxis) -> Problem:
    """Return what is tuned: full command as 1 rad, a servo before it, the record's own speed."""
    drive = Actuator(SURFACES[axis.axis], 1.0, 0.0, SERVO_HZ, 0.05, SERVO_RADPS,
                     0.5 * PULSE_PERIOD_S, PULSE_PERIOD_S / math.sqrt(12.0))  # fmt: skip
    law = structure(axis.axis, {}, axis.trim.airspeed_mps)
    return Problem(axis, drive, Hold(law.axis, law.fixed), (axis.trim.airspeed_mps,),
                   gyro_noise_radps=NOISE["p_radps"])  # fmt: skip


@dataclass(frozen=True)
class Flight:
    """Histories at the law's rate."""

    t_s: Array
    angle_rad: Mapping[str, Array]
    output: Mapping[str, Array]
    total: Mapping[str, Array]


def closed_loop(
    case: Case, tuned: Tuned, seconds: float,
    *, step: str | None = None, injected: Mapping[str, Array] | None = None,
) -> Flight:  # fmt: skip
    """Fly both holds, a step asked of one axis after a second, or sines added to the outputs."""
    craft, added = Craft(case), injected or {}
    start = craft.seen()
    laws = {a: p.structure.loop(g, p.airspeeds_mps[0]) for a, (p, g) in tuned.items()}
    states: dict[str, Array] = {a: np.zeros(law.states) for a, law in laws.items()}
    filters = {a: butter(2, p.structure.gyro_filter_hz, fs=1.0 / STEP_S)
               for a, (p, _) in tuned.items()}  # fmt: skip
    memory = {a: np.zeros(2) for a in tuned}
    at, held = dict.fromkeys(tuned, 0.0), dict.fromkeys(tuned, 0.0)
    lag = 1.0 - math.exp(-2.0 * math.pi * SERVO_HZ * STEP_S)
    kept: dict[str, dict[str, list[float]]] = {
        n: {a: [] for a in tuned} for n in ("angle", "out", "total")
    }
    for k in range(round(seconds / STEP_S)):
        seen = craft.seen()
        for a in tuned:
            asked = start[ANGLES[a]] + STEPS_RAD[a] * (a == step and k * STEP_S >= 1.0)
            (rate,), memory[a] = lfilter(*filters[a], [seen[RATES[a]]], zi=memory[a])
            error = asked - seen[ANGLES[a]]
            states[a], out = laws[a].step(states[a], np.array(error), np.array(rate))
            total = float(out) + (float(added[a][k]) if a in added else 0.0)
            if k % round(PULSE_PERIOD_S / STEP_S) == 0:
                held[a] = total
            at[a] += lag * (held[a] - at[a])
            for name, value in (("angle", seen[ANGLES[a]]), ("out", float(out)), ("total", total)):
                kept[name][a].append(value)
        craft.step({SURFACES[a]: p.axis.sense * at[a] for a, (p, _) in tuned.items()})
    found = {n: {a: np.array(v) for a, v in by.items()} for n, by in kept.items()}
    t = STEP_S * np.arange(round(seconds / STEP_S))
    return Flight(t, found["angle"], found["out"], found["total"])


def measured(case: Case, tuned: Tuned, a: str) -> Margins:
    """Return the margins of one axis from what comes back of injected sines in calm air."""
    steps = round(PERIOD_S / STEP_S)
    phase = -np.pi * np.arange(len(HARMONICS)) ** 2 / len(HARMONICS)  # Schroeder (1970)
    t = np.arange(steps) / steps
    wave = np.cos(2.0 * np.pi * HARMONICS[:, None] * t + phase[:, None]).sum(axis=0)
    wave *= LARGEST / np.max(np.abs(wave))
    flown = closed_loop(case, tuned, 3.0 * PERIOD_S, injected={a: np.tile(wave, 3)})
    cycles = HARMONICS.astype(int)
    # What trim drifts is taken out: the last period less its own line.
    last, at = slice(-steps, None), np.arange(steps)
    back, total = (
        np.fft.rfft(one[last] - np.polyval(np.polyfit(at, one[last], 1), at))[cycles]
        for one in (flown.output[a], flown.total[a])
    )
    return margins((-back / total)[None], 2.0 * np.pi * HARMONICS / PERIOD_S)


def computed(problem: Problem, gains: Mapping[str, float]) -> Margins:
    """Return the margins of the mean of the answer, as far as sines are injected."""
    axis, drive = problem.axis, problem.actuator
    mean = replace(
        problem,
        axis=replace(axis, covariance=np.zeros_like(axis.covariance)),
        actuator=replace(drive, bandwidth_share=0.0, delay_sd_s=0.0),
    )
    seen = draw(mean, seed=0, count=1)
    w, injected = seen.frequency_radps, 2.0 * np.pi * HARMONICS / PERIOD_S
    inside = (w >= injected[0]) & (w <= injected[-1])
    return margins(seen.loops(gains)[0][:, inside], w[inside])


def rows(case: Case, seed: int) -> Iterator[list[str | int | float]]:
    """Yield one row an axis: tuned from a record flown there, then flown there."""
    answer = identify(pd.DataFrame(record(case, seed)))
    found: dict[str, tuple[Problem, Design]] = {}
    for name, axis in axes_of(answer).items():
        problem = problem_of(axis)
        found[name] = problem, design(problem)
    tuned = {a: (p, d.gains) for a, (p, d) in found.items() if d.gains}
    for a, (problem, best) in found.items():
        title = f"{case.name}, {a}"
        if best.gains is None:
            yield [title, "none", "", "", "", math.nan, math.nan]
            continue
        gains = best.gains
        expected = computed(problem, gains)
        flown = measured(case, tuned, a)
        step = closed_loop(case, tuned, 9.0, step=a)
        share = (step.angle_rad[a][200:] - step.angle_rad[a][0]) / STEPS_RAD[a]
        rise = STEP_S * (int(np.argmax(share >= 0.9)) - int(np.argmax(share >= 0.1)))
        proven = best.verification
        yield [
            title,
            ", ".join(f"{gains[role]:g}" for role in ("P", "I", "D")),
            f"{proven.worst_gain_db:.1f}, {proven.worst_phase_deg:.0f}",
            f"{expected.gain_db[0]:.1f}, {expected.phase_deg[0]:.0f}",
            f"{flown.gain_db[0]:.1f}, {flown.phase_deg[0]:.0f}",
            rise if share.max() >= 0.9 else math.nan,
            max(100.0 * (float(share.max()) - 1.0), 0.0),
        ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly, identify, tune, fly and print."""
    parser = argparse.ArgumentParser(prog="python -m studies.jsbsim_gains", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    seed = parser.parse_args(arguments).seed
    found = tuple(tuple(row) for case in CASES for row in rows(case, seed))
    print(markdown(Table("holds tuned from JSBSim's records, flown in JSBSim", COLUMNS, found)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
