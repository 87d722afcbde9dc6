"""Tables 3.1 and 3.2 of the thesis re-run: what reproduces, what does not, and why.

The system of table 3.1 is a damaged NAVION whose state and input data are nearly singular; table
3.2 compares inputs and rates by a figure that divides a relative error once more by the number of
samples. Simulated data; input 0.1 rad, 20 s, from zero start, SNR 10 as ratio of variances.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.sysid.models import Maneuver, free_model
from host.thesis.error_figures import thesis_program_error_percent
from host.thesis.hopfield import (
    ITERATIONS,
    LAMBDA,
    RHO,
    STEP_S,
    iterate,
    largest_stable_gain,
    network,
)

from studies.inputs import SHAPES
from studies.navion import INPUTS, STATES, TABLE_31_A, TABLE_31_B
from studies.refusal import (
    AMPLITUDE_RAD,
    DURATION_S,
    agreement_text,
    refusal_agreement,
    repeated,
)
from studies.systems import DRAWS, simulated


def thesis_data(shape: str, rate_hz: float, *, snr: float = np.inf, seed: int = 1) -> Maneuver:
    """Return states and rates of the system of table 3.1, both with noise."""
    dt_s = 1.0 / rate_hz
    u = SHAPES[shape](AMPLITUDE_RAD, dt_s, DURATION_S)
    x = simulated(TABLE_31_A, TABLE_31_B, u, dt_s)
    rates = x @ TABLE_31_A.T + u @ TABLE_31_B.T
    rng = np.random.default_rng(seed)
    noisy = [
        s + np.sqrt(np.mean(s**2, axis=0) / snr) * rng.standard_normal(s.shape) for s in (x, rates)
    ]
    return Maneuver(dt_s, u, noisy[0], rates=noisy[1], name=f"{shape} {rate_hz:.0f} Hz")


def truth_31() -> Array:
    """Return the twenty parameters in the order of the table."""
    return np.concatenate([TABLE_31_A.ravel(), TABLE_31_B.ravel()])


@dataclass(frozen=True)
class HopfieldRun:
    """One Hopfield run judged by parameters and by the figure of the thesis."""

    what: str
    seconds: float
    iterations: int
    diverged: bool
    frobenius: float
    thesis_percent: float
    honest_percent: float


def run_hopfield(maneuver: Maneuver, gain: float, iterations: int, *, what: str) -> HopfieldRun:
    """Run the printed iteration from zero and judge its answer on the same input."""
    model = free_model("table 3.1", STATES, INPUTS)
    _, W, b = network(model, [maneuver])
    truth = truth_31()
    iterate(W, b, np.zeros(20), gain, RHO, 1, 1e6)
    begin = time.perf_counter()
    beta, done = iterate(W, b, np.zeros(20), gain, RHO, iterations, 1e6)
    seconds = time.perf_counter() - begin
    u = maneuver.inputs
    x = simulated(TABLE_31_A, TABLE_31_B, u, maneuver.dt_s)
    if done < iterations or not np.isfinite(beta).all():
        nan = float("nan")
        return HopfieldRun(what, seconds, done, True, nan, nan, nan)
    A, B, _, _ = model.matrices(beta)
    with np.errstate(over="ignore", invalid="ignore"):
        answer = simulated(A, B, u, maneuver.dt_s)
        thesis = thesis_program_error_percent(x, answer)
    return HopfieldRun(
        what=what,
        seconds=seconds,
        iterations=done,
        diverged=False,
        frobenius=float(np.linalg.norm(beta - truth) / np.linalg.norm(truth)),
        thesis_percent=thesis,
        honest_percent=thesis * len(x) / 4.0,
    )


def table_32(iterations: int = ITERATIONS) -> list[HopfieldRun]:
    """Run every input and rate of table 3.2 with the printed step and with the largest stable."""
    runs = []
    model = free_model("table 3.1", STATES, INPUTS)
    for shape in SHAPES:
        for rate_hz in (100.0, 20.0):
            maneuver = thesis_data(shape, rate_hz)
            _, W, _ = network(model, [maneuver])
            limit = largest_stable_gain(W)
            label = f"{shape} {rate_hz:.0f} Hz"
            printed = run_hopfield(
                maneuver,
                LAMBDA * STEP_S,
                iterations,
                what=f"{label}, printed step ({LAMBDA * STEP_S / limit:.2g} of the stable one)",
            )
            runs.append(printed)
            runs.append(
                run_hopfield(
                    maneuver, 0.95 * limit, iterations, what=f"{label}, largest stable step"
                )
            )
    return runs


def main(arguments: list[str] | None = None) -> int:
    """Print both tables and the refusals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--iterations", type=int, default=ITERATIONS)
    parser.add_argument("--systems", type=int, default=200)
    parser.add_argument("--seeds", type=int, default=100)
    options = parser.parse_args(arguments)
    write = sys.stdout.write
    write("table 3.2 re-run (noise-free): parameter error and the thesis's own figure\n")
    for run in table_32(options.iterations):
        verdict = (
            "diverged"
            if run.diverged
            else (
                f"parameters {100.0 * run.frobenius:5.1f} %"
                f"  thesis figure {run.thesis_percent:8.4f} %"
                f"  honest per state {run.honest_percent:7.2f} %"
            )
        )
        write(f"  {run.what:60s} {verdict}  {run.iterations} iterations {run.seconds:.3f} s\n")
    write("at SNR 10, 3-2-1-1, 100 Hz, by output error\n")
    for one in repeated(options.seeds):
        write(f"  {one.text}\n")
    for draw in DRAWS:
        write(agreement_text(refusal_agreement(options.systems, draw=draw)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
