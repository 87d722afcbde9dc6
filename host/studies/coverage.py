"""Coverage of the default 95 % intervals under four kinds of noise, against the Cramer-Rao width.

NAVION, 3-2-1-1, 20 s, SNR 10. The interval code does not get the noise. Each case also computes,
run by run, the width of the same model fitted with the true noise covariance.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators.output_error_ar_noise import fit_with_ar_noise
from host.sysid.estimators.start_values import start_values
from host.sysid.models import Maneuver
from host.sysid.numerics import ArNoise, OutputProblem, autocovariance, covariance_of_free, minimise
from scipy import signal, stats

from studies.inputs import multistep_3211
from studies.navion import navion_structured

SNR = 10.0
DURATION_S = 20.0
AMPLITUDE_RAD = 0.05
NOISES = {
    "white": np.zeros(0),
    "AR(1) 0.5": np.array([0.5]),
    "AR(1) 0.9": np.array([0.9]),
    "resonant AR(2)": np.array([2.0 * 0.95 * np.cos(0.3), -(0.95**2)]),  # poles 0.95 exp(+-0.3j)
}
RATES_HZ = (20.0, 100.0)
QUANTILE = float(stats.norm.ppf(0.975))


@dataclass(frozen=True)
class Coverage:
    """One case: coverage per parameter, pooled, and widths relative to the bound."""

    noise: str
    rate_hz: float
    names: tuple[str, ...]
    runs: int
    failed: int
    covered: Array
    width_ratio: Array
    rms_over_bound: Array
    white_covered: Array

    @property
    def pooled(self) -> float:
        """Coverage over all parameters and runs."""
        return float(np.mean(self.covered))


def coloured_noise(
    rng: np.random.Generator, coefficient: Array, samples: int, deviation: Array
) -> Array:
    """Return stationary AR noise (samples, columns) of the given standard deviations."""
    burn = 2000
    white = rng.standard_normal((samples + burn, len(deviation)))
    if len(coefficient) == 0:
        return white[burn:] * deviation
    series = signal.lfilter([1.0], np.concatenate([[1.0], -coefficient]), white, axis=0)[burn:]
    power = autocovariance(coefficient, 0)[0]
    return np.asarray(series / np.sqrt(power) * deviation, dtype=np.float64)


def run_case(noise: str, rate_hz: float, runs: int, *, seed: int = 20260101) -> Coverage:
    """Run one case of the study.

    Parameters
    ----------
    noise : str
        Key of `NOISES`.
    rate_hz : float
        Sample rate, Hz.
    runs : int
        Number of seeds.
    seed : int
        Base of the seeds; run k of a case always sees the same noise.
    """
    model = navion_structured()
    dt_s = 1.0 / rate_hz
    u = multistep_3211(AMPLITUDE_RAD, dt_s, DURATION_S)
    truth = np.concatenate([model.start, np.zeros(4)])
    blank = OutputProblem(model, [Maneuver(dt_s, u, np.zeros((len(u), 4)))])
    response = blank.respond(truth)
    assert response is not None
    y = response[0].y.T
    deviation = np.sqrt(np.mean(y**2, axis=0) / SNR)  # about the trim, which is zero
    coefficient = NOISES[noise]
    power = autocovariance(coefficient, 0)[0]
    memory = [ArNoise.from_coefficient(coefficient)] * 4
    known_variance = deviation**2 / power
    bound = minimise(blank, truth, noise=memory, variance=known_variance, max_iterations=0)
    crb = np.sqrt(np.diag(covariance_of_free(bound.information, bound.free)))
    covered, widths, errors, white = [], [], [], []
    failed = 0
    physical = len(model.parameters)
    for run in range(runs):
        rng = np.random.default_rng([seed, run, list(NOISES).index(noise), round(rate_hz)])
        measured = y + coloured_noise(rng, coefficient, len(u), deviation)
        maneuver = Maneuver(dt_s, u, measured)
        problem = OutputProblem(model, [maneuver])
        try:
            fit = fit_with_ar_noise(problem, start_values(problem))
            reference = minimise(problem, fit.optimum.theta, noise=memory, variance=known_variance)
        except IdentificationError:
            failed += 1
            continue
        error = fit.optimum.theta - truth
        dof = np.minimum(fit.degrees_of_freedom, 1e9)
        half = stats.t.ppf(0.975, dof) * np.sqrt(np.diag(fit.covariance))
        ideal = QUANTILE * np.sqrt(
            np.diag(covariance_of_free(reference.information, reference.free))
        )
        covered.append(np.abs(error) <= half)
        widths.append(half / ideal)
        errors.append(error / crb)
        white.append(np.abs(error) <= QUANTILE * np.sqrt(np.diag(fit.covariance_white)))
    return Coverage(
        noise=noise,
        rate_hz=rate_hz,
        names=tuple(p.name for p in model.parameters),
        runs=runs,
        failed=failed,
        covered=np.mean(covered, axis=0)[:physical],
        width_ratio=np.median(widths, axis=0)[:physical],
        rms_over_bound=np.sqrt(np.mean(np.square(errors), axis=0))[:physical],
        white_covered=np.mean(white, axis=0)[:physical],
    )


def table_line(case: Coverage) -> str:
    """Return one line of the table."""
    return (
        f"{case.noise:15s} {case.rate_hz:5.0f} Hz  runs {case.runs:5d} failed {case.failed:3d}"
        f"  pooled {100.0 * case.pooled:5.2f} %"
        f"  lowest {100.0 * case.covered.min():5.2f} ({case.names[int(case.covered.argmin())]})"
        f"  highest {100.0 * case.covered.max():5.2f}"
        f"  width/bound median {np.median(case.width_ratio):5.3f} max {case.width_ratio.max():5.3f}"
        f"  rms/CRB {case.rms_over_bound.min():4.2f}..{case.rms_over_bound.max():4.2f}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Print the table; `--runs` sets its size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--noise", choices=list(NOISES), action="append")
    parser.add_argument("--rate-hz", type=float, action="append")
    options = parser.parse_args(arguments)
    for noise in options.noise or NOISES:
        for rate_hz in options.rate_hz or RATES_HZ:
            begin = time.perf_counter()
            case = run_case(noise, rate_hz, options.runs)
            sys.stdout.write(table_line(case) + f"  {time.perf_counter() - begin:.0f} s\n")
            sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
