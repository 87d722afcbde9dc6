"""Closed-form least squares against the printed Hopfield iteration, both compiled alike.

Iterations grow with the condition of the normal matrix, which is a matter of units: speed in feet
per second next to radians makes it eleven times that of metres. The claim is about feet, in which
book and thesis print the aircraft; metres are given too, because this package has metres.
"""

from __future__ import annotations

import inspect
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np
from host.arrays import Array
from host.sysid.estimators.regression import solve_normal_equations
from host.sysid.models import Maneuver
from host.thesis.hopfield import iterate_until, largest_stable_gain, network
from studies.data import with_rates
from studies.navion import FOOT_M, navion_free

RHO = 200.0
SHARE = 0.01  # of the norm of the least-squares answer
STEP = 0.95  # of the largest stable one
MOST = 2_000_000_000


@dataclass(frozen=True)
class Race:
    """Seconds of both, iterations of one, condition number of the normal matrix."""

    closed_s: float
    hopfield_s: float
    iterations: int
    condition: float

    @property
    def ratio(self) -> float:
        """How many times faster the closed form is."""
        return self.hopfield_s / self.closed_s


def _closed_form(rows: Array, regressors: int) -> Array:
    """Solve the normal equations of signals (regressors, then rates; one row each)."""
    count, samples = rows.shape
    sums = np.zeros((regressors, count))
    for i in range(regressors):
        for j in range(i, count):
            total = 0.0
            for k in range(samples):
                total += rows[i, k] * rows[j, k]
            sums[i, j] = total
            if j < regressors:
                sums[j, i] = total
    return np.linalg.solve(sums[:, :regressors].copy(), sums[:, regressors:].copy())


def race(unit_m: float) -> Race:
    """Run both on one maneuver, speed in units of `unit_m` per second.

    Gradient descent feels units, least squares does not.
    """
    # Both free to reorder sums, for either gains from it. Not cached: numba's cache does not tell
    # a kernel from the same one with other flags.
    fast = numba.njit(error_model="numpy", fastmath=True)
    closed_form: Callable[[Array, int], Array] = fast(_closed_form)
    iteration: Callable[..., tuple[Array, int]] = fast(inspect.unwrap(iterate_until))
    metric = with_rates(1, 0.01, snr=10.0)
    turn = np.diag([1.0 / unit_m, 1.0, 1.0, 1.0])
    rates = np.asarray(metric.rates) @ turn
    maneuver = Maneuver(metric.dt_s, metric.inputs, metric.outputs @ turn, rates=rates)
    rows = np.ascontiguousarray(np.hstack([maneuver.outputs, maneuver.inputs, rates]).T)
    _, W, b = network(navion_free(), [maneuver])
    goal = solve_normal_equations(-W, b)
    closed = closed_form(rows, 5)
    A, B, _, _ = navion_free().matrices(goal)
    np.testing.assert_allclose(closed.T, np.hstack([A, B]), rtol=1e-6)
    laps = []
    for _ in range(20):
        begin = time.process_time()
        for _ in range(200):
            closed_form(rows, 5)
        laps.append((time.process_time() - begin) / 200.0)
    gain = STEP * largest_stable_gain(W, RHO)
    iteration(W, b, np.zeros(20), gain, RHO, goal, SHARE, 10)
    begin = time.process_time()
    _, done = iteration(W, b, np.zeros(20), gain, RHO, goal, SHARE, MOST)
    seconds = time.process_time() - begin
    return Race(statistics.median(laps), seconds, done, float(np.linalg.cond(W)))


def report(limit: float) -> bool:
    """Print both in units of the book and in SI; return whether the book's misses the limit."""
    book, metric = race(FOOT_M), race(1.0)
    for name, run, held in (
        ("feet, as book and thesis print it", book, f"limit {limit:.0f}"),
        ("metres", metric, "no limit"),
    ):
        print(
            f"closed form {1e6 * run.closed_s:.1f} us, Hopfield to 1 % {run.iterations} iterations"
            f" {run.hopfield_s:.3f} s: {run.ratio:.0f} times ({name}; {held}; condition of the"
            f" normal matrix {run.condition:.2g})"
        )
    print("  gradient descent walks along the worst-scaled direction, least squares does not")
    return book.ratio < limit
