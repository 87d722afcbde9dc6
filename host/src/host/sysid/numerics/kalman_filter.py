"""The Kalman filter: one recursion for linear models, equations, joint states and the smoother.

What differs is the model: its outputs at a sample, and its states and their covariance a sample
ahead. `filter_with` puts these two in their places. Where a model is not linear, or parameters are
states of it, this is the extended filter. Outputs of an instant are taken one after another, which
for uncorrelated noise is the same as all at once, and leaves innovations that are independent of
each other (Anderson & Moore, Optimal Filtering, 1979, sec. 6.4). An output that was not measured is
left out, and the gain follows what was (Durbin & Koopman, Time Series Analysis by State Space
Methods, 2nd ed., sec. 4.10). Slopes by the unknowns run along. First come those that the covariance
depends on, `shared` of them, the noise of each output last; then those of the states alone.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from host.arrays import Array, BoolArray
from host.compiled import compiled_part


def outputs_at(
    model: Any,
    k: int,
    seen: BoolArray,
    x: Array,
    by_x: Array,
    y: Array,
    by_y: Array,
    H: Array,
    by_H: Array,
) -> None:
    """Write outputs of sample `k` into `y` (p,) and their slopes by the state into `H` (p, n).

    `by_y` (p, L) and `by_H` (p, n, L) are slopes by the unknowns, of `y` those through `x` too.
    What was not `seen` may be left. Every model has its own.
    """
    raise NotImplementedError


def step_ahead(model: Any, k: int, x: Array, by_x: Array, P: Array, P_slopes: Array) -> bool:
    """Overwrite states, covariance and slopes by those before sample `k` + 1; False: diverged."""
    raise NotImplementedError


@compiled_part
def take_output(
    P: Array,
    P_slopes: Array,
    h: Array,
    by_h: Array,
    left: float,
    by_left: Array,
    variance: float,
    noise: int,
    change: Array,
    by_change: Array,
    by_spread: Array,
) -> float:
    """Correct the covariance by one output, and add to the states' change; return its variance.

    Parameters
    ----------
    P, P_slopes : Array, shape (n, n), (n, n, shared)
        Overwritten.
    h, by_h : Array, shape (n,), (n, L)
        Slopes of the output by the state.
    left : float
        Its innovation, given the outputs before.
    by_left : Array, shape (L,)
        Overwritten by slopes of the innovation over its deviation.
    variance, noise : float, int
        Variance of its noise, and the unknown that is the logarithm of that noise's deviation.
    change, by_change : Array, shape (n,), (n, L)
        Change of the states by the outputs of this sample, added to.
    by_spread : Array, shape (shared,)
        Overwritten by slopes of the returned variance over itself.
    """
    n, shared = len(P), P_slopes.shape[2]
    Ph = np.dot(P, h)
    spread = variance + float(np.dot(h, Ph))
    if not spread > 0.0:
        return spread
    gain = Ph / spread
    change += gain * left
    if shared:
        by_Ph = np.zeros((n, shared))
        by_spread[:] = 0.0
        for a in range(n):
            for b in range(n):
                for q in range(shared):
                    by_Ph[a, q] += P_slopes[a, b, q] * h[b] + P[a, b] * by_h[b, q]
            for q in range(shared):
                by_spread[q] += h[a] * by_Ph[a, q] + by_h[a, q] * Ph[a]
        by_spread[noise] += 2.0 * variance
        by_spread /= spread
        for a in range(n):
            for q in range(shared):
                by_change[a, q] += (by_Ph[a, q] / spread - gain[a] * by_spread[q]) * left
            for b in range(n):
                for q in range(shared):
                    P_slopes[a, b, q] -= (
                        gain[a] * (by_Ph[b, q] - Ph[b] * by_spread[q])
                        + by_Ph[a, q] * Ph[b] / spread
                    )
    if len(by_left):
        for a in range(n):
            for q in range(len(by_left)):
                by_change[a, q] += gain[a] * by_left[q]
        by_left /= np.sqrt(spread)
    P -= np.outer(gain, Ph)
    return spread


def filter_maneuver(
    model: Any,
    x: Array,
    by_x: Array,
    P: Array,
    P_slopes: Array,
    H: Array,
    by_H: Array,
    lower: Array,
    upper: Array,
    variance: Array,
    measured: Array,
    seen: BoolArray,
    by_independent: Array,
    by_spread: Array,
    e: Array,
    independent: Array,
    spread: Array,
) -> bool:
    """Filter one maneuver.

    Parameters
    ----------
    model
        What `outputs_at` and `step_ahead` of this filter take.
    x, by_x : Array, shape (n,), (n, L)
        Predicted at the first sample, and slopes. Overwritten by those behind the last.
    P, P_slopes : Array, shape (n, n), (n, n, shared)
        Its covariance, likewise.
    H, by_H : Array, shape (p, n), (p, n, L)
        Slopes of the outputs by the state, where they are always the same; else work.
    lower, upper : Array, shape (n,)
        Bounds of the state.
    variance : Array, shape (p,)
        Variance of the measurement noise.
    measured, seen : Array, shape (samples, p)
        What was measured, and whether.
    by_independent, by_spread : Array, shape (samples, p, L), (samples, p, shared)
        Overwritten by slopes of the innovations over their deviation, of their variance over
        itself.
    e, independent, spread : Array, shape (samples, p)
        Overwritten where something was measured: measured less predicted from the samples before,
        innovations given the outputs before in the same sample too, and their variance.

    Returns
    -------
    bool
        Whether every variance stayed positive, and the states finite.
    """
    n, total = by_x.shape
    outputs, shared = len(variance), P_slopes.shape[2]
    y, by_y = np.zeros(outputs), np.zeros((outputs, total))
    for k in range(len(measured)):
        outputs_at(model, k, seen[k], x, by_x, y, by_y, H, by_H)
        change, by_change = np.zeros(n), np.zeros((n, total))
        for j in range(outputs):
            if not seen[k, j]:
                continue
            by_left = by_independent[k, j]
            e[k, j] = measured[k, j] - y[j]
            independent[k, j] = e[k, j] - np.dot(H[j], change)
            if total:
                np.negative(by_y[j], by_left)
                for a in range(n):
                    for q in range(total):
                        by_left[q] -= by_H[j, a, q] * change[a] + H[j, a] * by_change[a, q]
            spread[k, j] = take_output(
                P, P_slopes, H[j], by_H[j], independent[k, j], by_left, variance[j],
                shared - outputs + j, change, by_change, by_spread[k, j],
            )  # fmt: skip
            if not spread[k, j] > 0.0:
                return False
        x += change
        by_x += by_change
        for a in range(n):
            if x[a] < lower[a]:
                x[a] = lower[a]
            elif x[a] > upper[a]:
                x[a] = upper[a]
        if k + 1 < len(measured) and not step_ahead(model, k, x, by_x, P, P_slopes):
            return False
    return True


def filter_with(outputs: Callable[..., None], step: Callable[..., bool]) -> Callable[..., bool]:
    """Return `filter_maneuver` of a kind of model, by its `outputs_at` and `step_ahead`."""
    places = globals() | {"outputs_at": outputs, "step_ahead": step}
    return FunctionType(filter_maneuver.__code__, places, filter_maneuver.__name__)


def predicted(P: Array, F: Array, power: Array) -> Array:
    """Return the covariance F P F' + Q a sample ahead; `power` (n,) is the diagonal of Q."""
    ahead = np.asarray(F @ (0.5 * (P + P.T)) @ F.T)
    ahead.flat[:: len(P) + 1] += power
    return ahead


def filter_without_slopes(
    run: Callable[..., bool],
    model: Any,
    x: Array,
    P: Array,
    variance: Array,
    measured: Array,
    seen: BoolArray,
    *,
    bounds: tuple[Array, Array] | None = None,
) -> tuple[Array, Array, Array] | None:
    """Filter one maneuver; None where that does not stay finite.

    Parameters
    ----------
    run : callable
        From `filter_with`, or the kernel of it.
    model
        What that takes.
    x, P : Array, shape (n,), (n, n)
        Predicted at the first sample. Overwritten by those behind the last.
    variance, measured, seen
        As of `filter_maneuver`.
    bounds : tuple of Array, optional
        Bounds of the state, (n,) each.

    Returns
    -------
    tuple of Array, shape (samples, p)
        Measured less predicted; innovations given the outputs before in the same sample too; the
        deviations of those. Where nothing was measured 0, 0 and 1.
    """
    n, size = len(x), measured.shape
    lower, upper = (np.full(n, -np.inf), np.full(n, np.inf)) if bounds is None else bounds
    e, independent, spread, none = np.zeros(size), np.zeros(size), np.ones(size), np.zeros(0)
    try:
        done = run(
            model, x, none.reshape(n, 0), P, none.reshape(n, n, 0), np.zeros((size[1], n)),
            none.reshape(size[1], n, 0), lower, upper, variance, measured, seen,
            none.reshape(*size, 0), none.reshape(*size, 0), e, independent, spread,
        )  # fmt: skip
    except (ArithmeticError, ValueError):  # Python raises where the machine's numbers are infinite
        return None
    done = done and all(np.isfinite(part).all() for part in (x, e, independent, spread))
    return (e, independent, np.sqrt(spread)) if done else None
