"""Gains of `host tune` flown on the twin's aircraft: stability, margins, steps, gusts.

    python -m studies.tuned_flights --aircraft-drawn 200

One flight of card `demo` is identified and tuned. Its gains are fixed, then flown on aircraft drawn
from the tolerances of the aircraft file around its truth, and on linear ones drawn from the
answer's covariance; besides them the autopilot's default gains, and those of PX4's autotune.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as `host identify` does

from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from host.aircraft.file import load_measured
from host.aircraft.linear_aircraft import load
from host.aircraft.trim import solve
from host.arrays import Array
from host.compiled import prefer_machine_code
from host.control import AUTOPILOTS, Tuning, tune
from host.control.actuator import PULSE_PERIOD_S
from host.control.autopilots.structure import Structure
from host.control.lateral_pair import PairProblem
from host.sysid.pipeline import identify
from host.twin.flight.draws import draw, true_airframe
from host.twin.virtual import virtual_flight

from studies.study_table import Cell, Table, markdown
from studies.tuned_flights.closed_loop_flight import (
    AXES,
    LONGEST_STEP_S,
    ClosedLoop,
    Demand,
    Flown,
    fly,
)
from studies.tuned_flights.height_and_speed import ENERGY_LAWS, Begin, Speeds
from studies.tuned_flights.linear_flight import fly_linear
from studies.tuned_flights.measured_margins import computed, measured
from studies.tuned_flights.px4_autotune import autotuned
from studies.tuned_flights.step_figures import moving_at_the_end, step_figures

AIRCRAFT = "ultrastick25e"
SPEEDS_MPS = (13.0, 17.0, 20.5)  # ends and trim of the aircraft file
STEPS = {"bank 30 deg": Demand(bank_rad=np.radians(30.0)),
         "pitch 8 deg": Demand(pitch_rad=np.radians(8.0))}  # fmt: skip
HEIGHT_M, AIRSPEED_MPS, SLOW_S = 10.0, 2.0, 60.0
GUSTS_MPS = (0.0, 1.0, 2.0)
SLOW_GUSTS_MPS = (0.0, 2.0)
SERVO_SHARE, BACK_SHARE = 0.5, 0.03  # servo at half speed, CG 3 % of the chord back
OUTSIDE_DB, OUTSIDE_DEG = 1.5, 8.0  # of the margins computed: an outlier, which is named
GYRO_NOISE_RADPS = 0.002
PROCESSES = 2
SIDE_BY_SIDE = 100  # aircraft: INAV's 1 kHz write 400 MB of their histories
OTHER_PART = 4  # default gains and those of PX4's autotune fly on every fourth of the aircraft
FIRST_SEED = 731_000
COLUMNS = ("case", "flights", "lost", "moving at the end", "rise s", "overshoot %", "settled s",
           "surface rad/s rms", "dB off", "deg off", "95 % within")  # fmt: skip
Gains = Mapping[str, Mapping[str, float]]
Result = TypeVar("Result")


def tuned(autopilot: str, seed: int) -> Tuning:
    """Return the gains of one flight of card `demo`, identified with its aircraft file."""
    flight = virtual_flight("demo", seed)
    return tune(identify(flight.table, aircraft=AIRCRAFT), aircraft=AIRCRAFT, autopilot=autopilot)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly and print."""
    parser = argparse.ArgumentParser(prog="python -m studies.tuned_flights", description=__doc__)
    parser.add_argument("--autopilot", choices=tuple(AUTOPILOTS), default="ardupilot")
    parser.add_argument("--aircraft-drawn", type=int, default=200)
    parser.add_argument("--processes", type=int, default=PROCESSES)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--only", action="append", metavar="WORD",
                        help="cases that begin with it, such as height; repeatable")  # fmt: skip
    asked = parser.parse_args(arguments)
    only = tuple(asked.only or ("",))
    found = tuned(asked.autopilot, asked.first)
    print(found.to_text(), end="\n\n")
    missing = [one.axis for one in found.axes if one.design.gains is None]
    if missing or len(found.axes) < len(AXES):
        print(f"no gains: {', '.join(missing) or 'an axis'}")
        return 1
    laws = {one.axis: one.problem.structure for one in found.axes}
    sets = {"tuned": {one.axis: dict(one.design.gains or {}) for one in found.axes}}
    if found.yaw and found.yaw.design.gains:
        sets["tuned"]["yaw"] = dict(found.yaw.design.gains)
    if found.autopilot.words:
        sets["default"] = {a: {r: s.default for r, s in laws[a].settings.items()} for a in AXES}
    if asked.autopilot == "px4":
        sets["autotune's"] = {one.axis: autotuned(one.problem) for one in found.axes}
    energy = energy_law(asked.autopilot)
    if energy is None:
        print("No law makes throttle of height and airspeed: neither is stepped.", end="\n\n")
    if not asked.only:
        drawn = from_covariance(found, asked.aircraft_drawn, asked.first)
        print(markdown(drawn), flush=True)
    with ProcessPoolExecutor(asked.processes, initializer=prefer_machine_code) as processes:
        for name, gains in sets.items():
            part = 1 if name == "tuned" else OTHER_PART
            seeds = range(asked.first, asked.first + max(asked.aircraft_drawn // part, 1))
            pair = found.yaw.problem if found.yaw and "yaw" in gains else None
            outer = energy if name == "tuned" else None
            craft = Craft(laws, gains, found.autopilot.travel_rad, pair, outer)
            found_in = Flights(craft, seeds, processes, only).table(
                f"{asked.autopilot}, {name} gains"
            )
            if found_in.rows:
                print(markdown(found_in), flush=True)
    return 0


def energy_law(autopilot: str) -> Begin | None:
    """Return the law of height and airspeed with the aircraft's own speeds; None where none is."""
    known = load_measured(AIRCRAFT).scalars
    names = ("minimum_airspeed_mps", "airspeed_mps", "maximum_airspeed_mps")
    speeds = Speeds(*(known[f"trim.{name}"] for name in names))
    return partial(ENERGY_LAWS[autopilot], speeds) if autopilot in ENERGY_LAWS else None


def from_covariance(found: Tuning, count: int, seed: int) -> Table:
    """Return one row an axis and airspeed: linear aircraft of a fresh drawing, flown."""
    rows: list[tuple[Cell, ...]] = []
    for one, (step, demand) in zip(found.axes, STEPS.items(), strict=True):
        flights = fly_linear(
            one.problem, one.design.gains or {}, demand, seed=seed + 7, count=count
        )
        for speed, flown in flights:
            row = list(_row(f"{step}, {speed:.1f} m/s", flown, demand))
            row[COLUMNS.index("surface rad/s rms")] = math.nan  # the servo's part is not known
            rows.append(tuple(row))
    return Table(f"{found.autopilot.name}, linear aircraft of the covariance", COLUMNS, tuple(rows))


def _row(case: str, flown: Sequence[Flown], demand: Demand, calm: bool = True) -> tuple[Cell, ...]:
    """Return how many of a case's flights were lost or still move, and the medians of the step."""
    kept = [one for one in flown if not one.lost]
    figures = np.array([step_figures(one, demand) for one in kept])
    with warnings.catch_warnings():  # a step that none settles has no median
        warnings.simplefilter("ignore", RuntimeWarning)
        middle = np.nanmedian(figures, axis=0).tolist()
    moving = sum(moving_at_the_end(one, demand) for one in kept) if calm else math.nan
    return (case, len(flown), len(flown) - len(kept), moving, *middle, math.nan, math.nan, "")


@dataclass(frozen=True)
class Craft:
    """Aircraft drawn from the tolerances of their file, with laws and gains."""

    laws: Mapping[str, Structure]
    gains: Gains
    full_rad: float | None = None
    pair: PairProblem | None = None
    energy: Begin | None = None

    def loop(
        self, seed: int, speed_mps: float, servo: float = 1.0, back: float = 0.0
    ) -> ClosedLoop:
        """Return one of them, its servo slower by a share, its CG back by a share of the chord."""
        rng = np.random.default_rng(seed)
        aircraft = load(AIRCRAFT)
        frame = true_airframe(aircraft, draw(aircraft, rng, tolerances=True))
        frame = frame._replace(
            servo_bandwidth_radps=servo * frame.servo_bandwidth_radps,
            servo_rate_radps=servo * frame.servo_rate_radps,
            cg_m=frame.cg_m - np.array([back * frame.chord_m, 0.0, 0.0]),
        )
        # On the flight's own steps: between them a pulse would be flown at another time.
        pulse_s = LONGEST_STEP_S * int(rng.uniform(0.0, PULSE_PERIOD_S) / LONGEST_STEP_S)
        at = solve(frame, speed_mps)
        return ClosedLoop(
            frame, at, self.laws, self.gains, pulse_s, self.full_rad, self.pair, energy=self.energy
        )

    def fly(
        self,
        seeds: Sequence[int],
        *,
        speed: float,
        demand: Demand,
        gusts: float,
        changes: tuple[float, ...],
    ) -> list[Flown]:
        """Return the flights of some."""
        loops = [self.loop(seed, speed, *changes) for seed in seeds]
        noise = GYRO_NOISE_RADPS if gusts else 0.0
        return fly(loops, demand, turbulence_mps=gusts, gyro_noise_radps=noise, seeds=seeds)

    def margins(self, seeds: Sequence[int], *, axis: str) -> Array:
        """Return gain (dB) and phase margin (deg), measured and computed, shape (N, 2, 2)."""
        loops = [self.loop(seed, SPEEDS_MPS[1]) for seed in seeds]
        flown, known = measured(loops, axis), [computed(one, axis) for one in loops]
        both = [flown.gain_db, flown.phase_deg], [
            [float(one.gain_db[0]) for one in known], [float(one.phase_deg[0]) for one in known]
        ]  # fmt: skip
        return np.array(both).transpose(2, 0, 1)


@dataclass(frozen=True)
class Flights:
    """All flights of one set of gains."""

    craft: Craft
    seeds: range
    processes: Executor
    only: tuple[str, ...] = ("",)

    def table(self, title: str) -> Table:
        """Return one row a case: flights lost or still moving, figures of the step; outliers."""
        rows = tuple(self._rows())
        axes = (*AXES, *(["yaw"] if self.craft.pair else []))
        margins = [self._margins(axis) for axis in axes if "margins".startswith(self.only)]
        outside = [line for _, lines in margins for line in lines]
        remark = "\n".join(outside) or "No margin is further from the computed one."
        return Table(title, COLUMNS, (*rows, *(row for row, _ in margins)), remark)

    def _rows(self) -> Iterator[tuple[Cell, ...]]:
        for speed in SPEEDS_MPS:
            for step, demand in self._steps(speed).items():
                for gusts in SLOW_GUSTS_MPS if demand.seconds == SLOW_S else GUSTS_MPS:
                    case = f"{step}, {speed:g} m/s, gusts {gusts:g} m/s"
                    yield self._row(case, demand, speed, gusts)
        for name, changes in (("servo at half speed", (SERVO_SHARE, 0.0)),
                              ("CG 3 % back", (1.0, BACK_SHARE))):  # fmt: skip
            speed = SPEEDS_MPS[1]
            for step, demand in self._steps(speed).items():
                yield self._row(f"{step}, {speed:g} m/s, {name}", demand, speed, 0.0, changes)

    def _steps(self, speed: float) -> dict[str, Demand]:
        """Return what is asked for; the airspeed steps towards the trim's from the fastest."""
        steps = dict(STEPS)
        if self.craft.energy is not None:
            faster = AIRSPEED_MPS if speed < SPEEDS_MPS[-1] else -AIRSPEED_MPS
            steps |= {
                f"height {HEIGHT_M:g} m": Demand(height_m=HEIGHT_M, seconds=SLOW_S),
                f"airspeed {faster:+g} m/s": Demand(airspeed_mps=faster, seconds=SLOW_S),
            }
        return {name: demand for name, demand in steps.items() if name.startswith(self.only)}

    def _margins(self, axis: str) -> tuple[tuple[Cell, ...], list[str]]:
        """Return a row of measured minus computed margins, and a line of each outlier."""
        both = np.concatenate(self._shared(partial(self.craft.margins, axis=axis)))
        off = both[:, 0] - both[:, 1]
        outside = np.any(np.abs(off) > (OUTSIDE_DB, OUTSIDE_DEG), axis=1)
        within = np.quantile(np.abs(off), 0.95, axis=0)
        lines = [
            f"- outside, {axis}, aircraft {seed}: measured {db:.1f} dB {deg:.0f} deg,"
            f" computed {known_db:.1f} dB {known_deg:.0f} deg"
            for seed, ((db, deg), (known_db, known_deg)) in zip(
                np.array(self.seeds)[outside], both[outside], strict=True
            )
        ]
        lost = int(np.sum(~both[:, 0].any(axis=1)))
        row = (f"margins, {axis}, {SPEEDS_MPS[1]:g} m/s", len(off), lost, *[math.nan] * 5,
               *np.mean(off, axis=0).tolist(),
               f"{within[0]:.2f} dB, {within[1]:.1f} deg; {outside.sum()} outside")  # fmt: skip
        return row, lines

    def _row(
        self,
        case: str,
        demand: Demand,
        speed: float,
        gusts: float,
        changes: tuple[float, ...] = (),
    ) -> tuple[Cell, ...]:
        some = partial(self.craft.fly, speed=speed, demand=demand, gusts=gusts, changes=changes)
        part = OTHER_PART if demand.seconds == SLOW_S else 1
        flown = [one for some_of in self._shared(some, part) for one in some_of]
        return _row(case, flown, demand, calm=not gusts)

    def _shared(self, work: Callable[[Sequence[int]], Result], part: int = 1) -> list[Result]:
        """Return what every so many of the aircraft gave, as many at a time as memory takes."""
        seeds = self.seeds[::part]
        parts = [seeds[k : k + SIDE_BY_SIDE] for k in range(0, len(seeds), SIDE_BY_SIDE)]
        return list(self.processes.map(work, parts))


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
