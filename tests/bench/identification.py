"""Speed of identification: output error, closed-form least squares, and the whole verb.

    python tests/bench/identification.py             # everything, some three minutes
    python tests/bench/identification.py --seeds 20  # quicker

One core; times are processor time, so that a busy machine does not count. NAVION, 3-2-1-1, 100 Hz,
20 s, SNR 10: A and B free (20) and 4 start states, 2000 samples, 4 outputs, noise covariance
estimated, started from its own equation error, to a step below 0.01 Cramer-Rao bounds, covariance
included. Simulated data throughout.
"""

import argparse
import os
import platform
import statistics
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "host"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "host/src"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from host.sysid.estimators.start_values import start_values
from host.sysid.numerics import OutputProblem, covariance_of_free, minimise, recursion
from studies.data import noisy
from studies.navion import navion_free

from tests.bench import identification_hopfield, identify_log
from tests.bench.fixed_work import unit_s
from tests.bench.identification_peers import aeroid_fit, lsim_s, scipy_distance

FIT_UNITS = 0.06  # of the fixed computation
STEP_LIMIT = 0.05  # Cramer-Rao bounds between our optimum and that of scipy
PEER_RATIO = 100.0
HOPFIELD_RATIO = 5000.0
PEER_SEEDS = 5


def fit_once(seed: int) -> tuple[float, float, OutputProblem, np.ndarray, np.ndarray]:
    """Return seconds with and without the start values, problem, optimum and bounds."""
    maneuver = noisy(seed, 0.01)
    begin = time.process_time()
    problem = OutputProblem(navion_free(), [maneuver])
    start = start_values(problem)
    middle = time.process_time()
    found = minimise(problem, start)
    covariance = covariance_of_free(found.information, found.free)
    end = time.process_time()
    if not found.converged:
        raise SystemExit(f"seed {seed}: no convergence")
    return end - begin, end - middle, problem, found.theta, np.sqrt(np.diag(covariance))


def fits(
    seeds: int, worth_compiling: float
) -> list[tuple[float, float, OutputProblem, np.ndarray, np.ndarray]]:
    """Run `fit_once` on seeds 1 to `seeds`, as machine code from the first fit on or never."""
    recursion.WORTH_COMPILING = worth_compiling
    fit_once(0)
    return [fit_once(seed) for seed in range(1, seeds + 1)]


def output_error(seeds: int) -> bool:
    """Print the fit's time and its peers; return whether a limit is missed."""
    plain = 1e3 * statistics.median(run[0] for run in fits(max(10, seeds // 5), np.inf))
    print(f"output error 20 + 4 in numpy, as one flight's answer fits: {plain:.2f} ms")
    runs = fits(seeds, 0.0)
    whole = 1e3 * statistics.median(run[0] for run in runs)
    search = 1e3 * statistics.median(run[1] for run in runs)
    took = 1e-3 * whole / unit_s()
    print(
        f"output error 20 + 4 as machine code, median of {seeds}: {whole:.2f} ms with problem and"
        f" start values, {took:.3f} units (limit {FIT_UNITS}), search"
        f" and covariance alone {search:.2f} ms"
    )
    distance = max(scipy_distance(*run[2:]) for run in runs[:PEER_SEEDS])
    print(f"distance to scipy least_squares: {distance:.4f} bounds (limit {STEP_LIMIT})")
    peers = {"lsim-based fit": lsim_s(runs[0][2], runs[0][4])}
    peers["AeroID 0.5.0"], off = aeroid_fit(*runs[0][2:])
    for name, seconds in peers.items():
        ratio = 1e3 * seconds / whole
        print(f"{name}: {seconds:.1f} s, {ratio:.0f} times ours (limit {PEER_RATIO:.0f})")
    print(f"  AeroID, given the noise, ends {off:.2g} bounds from our optimum")
    slow = min(peers.values()) < PEER_RATIO * 1e-3 * whole
    return took > FIT_UNITS or distance > STEP_LIMIT or slow


def main() -> int:
    """Print the figures and their limits; exit 6 if one is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    options = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}")
    missed = output_error(options.seeds)
    missed |= identification_hopfield.report(HOPFIELD_RATIO)
    missed |= identify_log.report()
    return 6 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
