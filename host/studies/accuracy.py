"""Accuracy on the NAVION: three inputs, two rates, SNR 10, against the Cramer-Rao bound.

White noise on states and on the analytic state rates, input exact. Compared: the Hopfield fixed
point on noisy rates (which is ordinary least squares), least squares on Savitzky-Golay rates, and
structured output error.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators import regression_equations
from host.sysid.estimators.regression import solve_least_squares
from host.sysid.estimators.start_values import start_values
from host.sysid.models import Maneuver
from host.sysid.models.diagnostics import reference_values
from host.sysid.numerics import OutputProblem, covariance_of_free, minimise
from host.thesis.hopfield import network

from studies.data import clean
from studies.inputs import SHAPES
from studies.navion import navion, navion_free, navion_structured

SNR = 10.0
RATES_HZ = (100.0, 20.0)


@dataclass(frozen=True)
class Accuracy:
    """One case: median relative errors over runs and parameters, error over bound per parameter."""

    shape: str
    rate_hz: float
    names: tuple[str, ...]
    runs: int
    failed: int
    hopfield_error: float  # all twenty entries the network estimates
    hopfield_shared: float  # the nine that output error estimates too
    smoothed_error: float
    output_error: float
    rms_over_bound: Array

    @property
    def ratio(self) -> float:
        """How many times closer output error is than the Hopfield fixed point, each its own."""
        return self.hopfield_error / self.output_error

    @property
    def shared_ratio(self) -> float:
        """The same over the nine parameters both estimate."""
        return self.hopfield_shared / self.output_error

    @property
    def smoothed_ratio(self) -> float:
        """How many times closer output error is than least squares on smoothed rates."""
        return self.smoothed_error / self.output_error


def run_case(shape: str, rate_hz: float, runs: int, *, seed: int = 20260201) -> Accuracy:
    """Run one case of the study; run k always sees the same noise."""
    dt_s = 1.0 / rate_hz
    u, y = clean(dt_s, shape=shape)
    A, B = navion()
    rates = y @ A.T + u @ B.T
    structured, free = navion_structured(), navion_free()
    truth = np.concatenate([structured.start, np.zeros(4)])
    truth_free = np.concatenate([A.ravel(), B.ravel()])
    # Perturbations: the trim is zero, so the variance about it is the mean square.
    deviation = np.sqrt(np.mean(y**2, axis=0) / SNR)
    rate_deviation = np.sqrt(np.mean(rates**2, axis=0) / SNR)
    spotless = Maneuver(dt_s, u, y)
    reference = reference_values(structured, [spotless], truth)
    reference_free = reference_values(free, [spotless], truth_free)
    exact = OutputProblem(structured, [spotless])
    at_truth = minimise(exact, truth, variance=deviation**2, max_iterations=0)
    bound = np.sqrt(np.diag(covariance_of_free(at_truth.information, at_truth.free)))
    hopfield, smoothed, output, ratios = [], [], [], []
    failed = 0
    physical = len(structured.parameters)
    for run in range(runs):
        rng = np.random.default_rng([seed, run, list(SHAPES).index(shape), round(rate_hz)])
        noisy = y + deviation * rng.standard_normal(y.shape)
        noisy_rates = rates + rate_deviation * rng.standard_normal(y.shape)
        _, W, b = network(free, [Maneuver(dt_s, u, noisy, rates=noisy_rates)])
        fixed_point = np.linalg.solve(-W, b)
        hopfield.append(np.abs(fixed_point - truth_free) / reference_free)
        plain = Maneuver(dt_s, u, noisy)
        names, rows = regression_equations(free, [plain])
        smoothed.append(np.abs(solve_least_squares(rows, len(names)) - truth_free) / reference_free)
        problem = OutputProblem(structured, [plain])
        try:
            found = minimise(problem, start_values(problem))
        except IdentificationError:
            failed += 1
            continue
        if not found.converged:
            failed += 1
        output.append((np.abs(found.theta - truth)[:physical]) / reference)
        ratios.append(((found.theta - truth) / bound)[:physical])
    return Accuracy(
        shape=shape,
        rate_hz=rate_hz,
        names=tuple(p.name for p in structured.parameters),
        runs=runs,
        failed=failed,
        hopfield_error=float(np.median(hopfield)),
        hopfield_shared=float(np.median(np.array(hopfield)[:, _shared(free.parameter_names)])),
        smoothed_error=float(np.median(np.array(smoothed)[:, _shared(free.parameter_names)])),
        output_error=float(np.median(output)),
        rms_over_bound=np.sqrt(np.mean(np.square(ratios), axis=0)),
    )


def _shared(names: tuple[str, ...]) -> list[int]:
    """Return where the nine physical derivatives stand among the twenty free entries."""
    physical = ("a11", "a12", "a21", "a22", "a31", "a32", "a33", "b21", "b31")
    return [names.index(name) for name in physical]


def table_line(case: Accuracy) -> str:
    """Return one line of the table."""
    return (
        f"{case.shape:8s} {case.rate_hz:5.0f} Hz  runs {case.runs:5d} failed {case.failed:3d}"
        f"  median error: Hopfield fixed point {100.0 * case.hopfield_error:6.2f} % of 20,"
        f" {100.0 * case.hopfield_shared:6.2f} % of the 9"
        f"  smoothed rates {100.0 * case.smoothed_error:6.2f} %"
        f"  output error {100.0 * case.output_error:5.2f} %"
        f"  ratio {case.ratio:5.1f}, {case.shared_ratio:5.1f}; smoothed {case.smoothed_ratio:4.1f}"
        f"  rms(error/bound) {case.rms_over_bound.min():.3f}..{case.rms_over_bound.max():.3f}"
        f" mean {case.rms_over_bound.mean():.3f}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Print the table; `--runs` sets its size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--shape", choices=list(SHAPES), action="append")
    parser.add_argument("--rate-hz", type=float, action="append")
    options = parser.parse_args(arguments)
    for shape in options.shape or SHAPES:
        for rate_hz in options.rate_hz or RATES_HZ:
            begin = time.perf_counter()
            case = run_case(shape, rate_hz, options.runs)
            sys.stdout.write(table_line(case) + f"  {time.perf_counter() - begin:.0f} s\n")
            sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
