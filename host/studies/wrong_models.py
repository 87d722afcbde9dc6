"""Is "trust" earned? Wrong models against right ones, judged as `host identify` judges.

Linear flights of known derivatives (`wrong_flights`); a wrong model lacks a derivative or a servo's
lag, is linear where the aircraft is not, or gets an airspeed that is 10 % wrong. A parameter
without a truth is compared with what the same estimator says without noise.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from host.compiled import prefer_machine_code
from host.errors import IdentificationError
from host.physical.recording import FOREIGN, Recording
from host.sysid.answer import CAREFUL, TRUSTED
from host.sysid.models import Maneuver
from host.sysid.numerics import OutputProblem, minimise
from host.sysid.numerics.input_coherence import input_coherence
from host.sysid.pipeline import Identification, at_hand, identify_columns

from studies.coverage import NOISES as NOISE_COLOURS
from studies.coverage import SNR, coloured_noise
from studies.inputs import multistep_3211
from studies.navion import navion_structured
from studies.wrong_flights import FAULTS, NOISES, PRINCIPAL, LinearFlight, fly

ALARM_SEED = 20261122
FIRST_SEED = 17100  # those below were looked at
RIGHT = FAULTS[0]
CLOSE = 0.10
QUIET = 0.02  # of the noise: a fit to it shows the limit of the estimator
METHODS = {
    "short-period": ("flight", "output-error"),
    "lateral": ("flight", "output-error"),
}
SIZES = {"small": 1, "full": 40}  # flights of each row
ALARM_RUNS = {"small": 50, "full": 1000}


@dataclass(frozen=True, slots=True)
class Judged:
    """One principal derivative of one flight: relative error and half-width, and its mark."""

    name: str
    error: float
    half_width: float
    mark: str

    @property
    def held(self) -> bool:
        """Whether the interval holds the truth, or the limit."""
        return abs(self.error) <= self.half_width

    @property
    def relied_on(self) -> bool:
        """Whether a reader may use it."""
        return self.mark in (TRUSTED, CAREFUL)


@dataclass(frozen=True, slots=True)
class Row:
    """What is flown and fitted."""

    template: str
    fault: str
    noise: str
    method: str

    @property
    def key(self) -> str:
        """Name of the row."""
        return ", ".join((self.template, self.fault, self.noise, self.method))


def rows() -> Iterator[Row]:
    """Return every row of the study."""
    for name, methods in METHODS.items():
        for fault in FAULTS:
            for noise in NOISES:
                for method in methods:
                    yield Row(name, fault, noise, method)


def judge(row: Row, seed: int, limit: dict[str, float]) -> list[Judged]:
    """Fly once, identify, and compare with the truth, or with the limit where there is none."""
    flight = fly(row.template, row.fault, row.noise, seed)
    identified = identified_from(row, flight)
    [answer], marks = identified.linear, identified.verdicts[0].marks
    half = answer.result.half_width()
    found = []
    for name in PRINCIPAL[row.template]:
        if name in answer.result.names:
            k, expected = answer.result.index(name), flight.truth.get(name, limit[name])
            error = (float(answer.result.estimate[k]) - expected) / abs(expected)
            found.append(Judged(name, error, float(half[k]) / abs(expected), marks[name]))
    return found


def identified_from(row: Row, flight: LinearFlight) -> Identification:
    """Return what `host identify` says of a flight."""
    flown = at_hand(flight.columns, windows=flight.windows, recording=Recording(maker=FOREIGN))
    return identify_columns(flown, models=flight.model or row.template, methods=row.method)


def noise_free_limit(row: Row) -> dict[str, float]:
    """Return the limit of the estimator of an equation without noise."""
    [answer] = identified_from(row, fly(row.template, row.fault, "white", 0, scale=QUIET)).linear
    return {n: answer.result.value(n) for n in answer.model.parameter_names}


def run_row(row: Row, seeds: range) -> list[Judged]:
    """Return the derivatives of every flight of a row; a flight without an answer has none."""
    limit = noise_free_limit(row)
    found = []
    for seed in seeds:
        try:
            found += judge(row, seed, limit)
        except IdentificationError:
            continue
    return found


def summary(row: Row, found: list[Judged]) -> str:
    """Return a line of the table: how often held, relied on, and relied on in vain."""
    count = max(len(found), 1)
    held = sum(j.held for j in found) / count
    relied = sum(j.relied_on for j in found) / count
    in_vain = sum(j.relied_on and not j.held for j in found) / count
    line = (
        f"{row.key:55s} held {100.0 * held:5.1f} %  relied on {100.0 * relied:5.1f} %"
        f"  of them not held {100.0 * in_vain / max(relied, 1e-9):5.1f} %"
    )
    if row.fault != RIGHT:
        return line
    right = [j for j in found if abs(j.error) <= CLOSE and j.held and j.half_width <= CLOSE]
    kept = sum(j.mark == TRUSTED for j in right) / max(len(right), 1)
    return f"{line}  right ones kept {100.0 * kept:5.1f} % of {len(right)}"


def false_alarms(noise: str, runs: int) -> float:
    """Return the share of right models that the test accuses, NAVION of 20 s at 20 Hz.

    Parameters
    ----------
    noise : str
        One of `studies.coverage.NOISES`.
    runs : int
    """
    model, dt_s = navion_structured(), 0.05
    u = multistep_3211(0.05, dt_s, 20.0)
    start = np.concatenate([model.start, np.zeros(4)])
    response = OutputProblem(model, [Maneuver(dt_s, u, np.zeros((len(u), 4)))]).respond(start)
    if response is None:
        raise IdentificationError("the NAVION diverges")
    y = response[0].y.T
    deviation = np.sqrt(np.mean(y**2, axis=0) / SNR)
    alarms = 0
    for run in range(runs):
        rng = np.random.default_rng([ALARM_SEED, run, list(NOISE_COLOURS).index(noise)])
        measured = y + coloured_noise(rng, NOISE_COLOURS[noise], len(u), deviation)
        problem = OutputProblem(model, [Maneuver(dt_s, u, measured)])
        found = minimise(problem, start)
        alarms += bool(input_coherence(problem, found.responses, found.theta).coherent)
    return alarms / runs


def main(arguments: list[str] | None = None) -> int:
    """Fly, fit, judge, print; rows that a folder holds already are not flown again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", choices=list(SIZES), default="small")
    parser.add_argument("--flights", type=int, help="flights of each row, in place of a size")
    parser.add_argument("--alarms", type=int, help="right models in each noise, likewise")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--folder", type=Path, help="where rows are kept, to go on after a stop")
    parser.add_argument("--only", help="rows whose name holds this")
    options = parser.parse_args(arguments)
    prefer_machine_code()
    count = options.flights or SIZES[options.size]
    seeds = range(options.first, options.first + count)
    if not options.only:
        for noise in NOISE_COLOURS:
            runs = options.alarms or ALARM_RUNS[options.size]
            share = 100.0 * false_alarms(noise, runs)
            sys.stdout.write(f"right models accused, {noise}: {share:.1f} % of {runs}\n")
            sys.stdout.flush()
    every: dict[Row, list[Judged]] = {}
    for row in rows():
        if options.only and options.only not in row.key:
            continue
        every[row] = kept_row(row, seeds, options.folder)
        sys.stdout.write(summary(row, every[row]) + "\n")
        sys.stdout.flush()
    return 0


def kept_row(row: Row, seeds: range, folder: Path | None) -> list[Judged]:
    """Return a row, from the folder if it was flown before."""
    if folder is None:
        return run_row(row, seeds)
    path = folder / f"{row.key} {seeds.start}-{seeds.stop}.json".replace(", ", "_").replace(
        " ", "_"
    )
    if path.exists():
        return [Judged(**one) for one in json.loads(path.read_text(encoding="utf-8"))]
    found = run_row(row, seeds)
    folder.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps([asdict(one) for one in found]), encoding="utf-8")
    return found


if __name__ == "__main__":
    sys.exit(main())
