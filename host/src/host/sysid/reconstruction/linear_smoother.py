"""A Kalman filter and the smoother behind it (Rauch, Tung & Striebel, AIAA Journal 3, 1965)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from host.arrays import Array
from host.sysid.numerics.kalman_step import corrected, predicted


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
    means, spreads = np.empty((count, size)), np.empty((count, size, size))
    x, P = mean, covariance
    for k, step in enumerate(steps):
        x, P, _ = corrected(x, P, step.H, step.seen - step.H @ x, step.sd**2)
        means[k], spreads[k] = x, P
        x, P = step.F @ x + step.known, predicted(P, step.F, step.power)
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
