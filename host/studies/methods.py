"""Every method on the same five data sets: error, interval, time."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.estimators import fit, methods
from host.sysid.models import Maneuver
from host.sysid.models.diagnostics import reference_values

from studies.coverage import NOISES, coloured_noise
from studies.data import TRUTH, clean, gusty
from studies.navion import navion_structured

SNR = 10.0
# A third of a second each and more: these fly a sixth of the seeds of the others, the line search,
# one simulation per trial step and 1.5 s each, a twelfth.
DEAR = ("filter-error", "extended-kalman", "unscented-kalman", "genetic", "neural-delta")
SHARES = {**dict.fromkeys(DEAR, 6), "hopfield-line-search": 12}

# Least squares, its own start, would tell nothing of what the search does from 20 % off.
OPTIONS: dict[str, dict[str, object]] = {"hopfield-line-search": {"start": "model"}}


def runs_of(method: str, runs: int) -> int:
    """Return how many of `runs` seeds a method gets, at least one."""
    return max(1, runs // SHARES.get(method, 1))


def _with_noise(noise: str, dt_s: float, shape: str, seed: int) -> Maneuver:
    u, y = clean(dt_s, shape=shape)
    rng = np.random.default_rng(seed)
    deviation = np.sqrt(np.mean(y**2, axis=0) / SNR)
    return Maneuver(dt_s, u, y + coloured_noise(rng, NOISES[noise], len(u), deviation))


DATA: dict[str, Callable[[int], Maneuver]] = {
    "3-2-1-1, white": lambda seed: _with_noise("white", 0.02, "3-2-1-1", seed),
    "doublet, white": lambda seed: _with_noise("white", 0.02, "doublet", seed),
    "3-2-1-1, 20 Hz": lambda seed: _with_noise("white", 0.05, "3-2-1-1", seed),
    "3-2-1-1, AR(1) 0.9": lambda seed: _with_noise("AR(1) 0.9", 0.02, "3-2-1-1", seed),
    "3-2-1-1, gusts": lambda seed: gusty(seed, 0.02),
}


@dataclass(frozen=True)
class Score:
    """One method on one data set: medians over runs and the nine derivatives."""

    method: str
    data: str
    runs: int
    failed: int
    error: float
    half_width: float
    covered: float
    seconds: float


def score(method: str, data: str, runs: int) -> Score:
    """Run one method on one data set; seeds are the run numbers."""
    model = navion_structured().with_start(1.2 * TRUTH)
    errors: list[Array] = []
    halves: list[Array] = []
    seconds: list[float] = []
    failed = 0
    for seed in range(runs):
        maneuver = DATA[data](seed)
        reference = reference_values(navion_structured(), [maneuver], TRUTH)
        begin = time.process_time()
        try:
            result = fit(method, model, [maneuver], **OPTIONS.get(method, {}))
        except IdentificationError:
            failed += 1
            continue
        seconds.append(time.process_time() - begin)
        errors.append(np.abs(result.estimate[:9] - TRUTH) / reference)
        halves.append(result.half_width()[:9] / reference)
    if not errors:
        nan = float("nan")
        return Score(method, data, runs, failed, nan, nan, nan, nan)
    covered = float(np.mean(np.array(errors) <= np.array(halves)))
    return Score(
        method,
        data,
        runs,
        failed,
        float(np.median(errors)),
        float(np.median(halves)),
        covered,
        float(np.median(seconds)),
    )


def main(arguments: list[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=12)
    parser.add_argument("--method", action="append")
    options = parser.parse_args(arguments)
    write = sys.stdout.write
    write("median error %, median 95 % half-width %, coverage %, ms; NAVION, nine derivatives\n")
    for method in options.method or methods():
        cells = []
        for data in DATA:
            s = score(method, data, runs_of(method, options.runs))
            cells.append(
                f"{100.0 * s.error:6.1f} {100.0 * s.half_width:6.1f} {100.0 * s.covered:4.0f}"
                f" {1e3 * s.seconds:7.1f}" + (f" ({s.failed} failed)" if s.failed else "")
            )
        write(f"{method:26s} | " + " | ".join(cells) + "\n")
        sys.stdout.flush()
    write(f"{'data sets':26s} | " + " | ".join(DATA) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
