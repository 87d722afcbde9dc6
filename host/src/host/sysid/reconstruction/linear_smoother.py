"""A Kalman filter and the smoother behind it (Rauch, Tung & Striebel, AIAA Journal 3, 1965)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from host.arrays import Array, BoolArray
from host.sysid.numerics.kalman_filter import filter_with, filter_without_slopes, predicted


class Step(NamedTuple):
    """One step: x[k+1] = F x[k] + known + noise of variances `power`; seen = H x[k] + noise."""

    F: Array
    known: Array
    power: Array
    H: Array
    seen: Array
    sd: Array


def smooth(mean: Array, covariance: Array, steps: Sequence[Step]) -> tuple[Array, Array]:
    """Return means (m, n) and covariances (m, n, n) of the states given all measurements.

    Parameters
    ----------
    mean, covariance : Array, shape (n,), (n, n)
        Before the first measurement.
    steps : sequence of Step
    """
    count, size = len(steps), len(mean)
    rows = max(len(step.seen) for step in steps)
    seen = np.array([np.arange(rows) < len(step.seen) for step in steps])
    known = np.zeros(seen.shape)
    known[seen] = np.concatenate([step.seen / step.sd for step in steps])
    passed = _Passed(steps, [], [])
    x, P = mean.copy(), covariance.copy()
    if filter_without_slopes(_filter, passed, x, P, np.ones(rows), known, seen) is None:
        raise np.linalg.LinAlgError("the filter before the smoother diverged")
    means, spreads = np.array([*passed.means, x]), np.array([*passed.spreads, P])
    for k in range(count - 2, -1, -1):
        step = steps[k]
        FP, ahead = step.F @ spreads[k], predicted(spreads[k], step.F, step.power)
        # Constants have no noise of their own: a share of rounding keeps the inverse finite.
        scale = np.sqrt(np.maximum(np.diag(ahead), 1e-30))
        scaled = ahead / scale / scale[:, None] + 1e-10 * np.eye(size)
        back = np.linalg.solve(scaled, FP / scale[:, None]).T / scale
        means[k] += back @ (means[k + 1] - step.F @ means[k] - step.known)
        spreads[k] += back @ (spreads[k + 1] - ahead) @ back.T
    return means, spreads


class _Passed(NamedTuple):
    """Steps, and what the filter found at each sample that it stepped from."""

    steps: Sequence[Step]
    means: list[Array]
    spreads: list[Array]


def _outputs(
    passed: _Passed, k: int, seen: BoolArray, x: Array, by_x: Array, y: Array, by_y: Array,
    H: Array, by_H: Array,
) -> None:  # fmt: skip
    """Write measurements in their deviations."""
    step = passed.steps[k]
    H[seen] = step.H / step.sd[:, None]
    y[:] = H @ x


def _step(passed: _Passed, k: int, x: Array, by_x: Array, P: Array, P_slopes: Array) -> bool:
    passed.means.append(x.copy())
    passed.spreads.append(P.copy())
    x[:] = passed.steps[k].F @ x + passed.steps[k].known
    P[:] = predicted(P, passed.steps[k].F, passed.steps[k].power)
    return True


_filter = filter_with(_outputs, _step)
