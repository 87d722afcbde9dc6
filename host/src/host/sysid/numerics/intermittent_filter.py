"""A Kalman filter of a linear model whose outputs are measured at some of the samples only.

An output that was not measured is left out of the measurement update, and the gain follows what
was, whatever the pattern (Durbin & Koopman, Time Series Analysis by State Space Methods, 2nd ed.,
sec. 4.10; Jategaonkar, Flight Vehicle System Identification, 2nd ed., ch. 5). Outputs of an instant
are taken one after another, which for uncorrelated noise is the same as all at once, and leaves
innovations that are independent of each other (Anderson & Moore, Optimal Filtering, 1979, sec.
6.4). Slopes by the unknowns run along. First come those that the covariance depends on, `shared` of
them, the noise of each output last; then those of the states alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.compiled import compiled, compiled_part
from host.sysid.models.maneuver import Maneuver
from host.sysid.numerics.innovation_problem import InnovationSlopes
from host.sysid.numerics.recursion import STATE_LIMIT
from host.sysid.numerics.sampled_model import SampledModel


@dataclass(frozen=True, slots=True)
class FilterEquations:
    """A linear model over one sample and its noise, with slopes by L unknowns, `shared` of them.

    Attributes
    ----------
    model : SampledModel
        Its start is the predicted state of the first sample.
    Q, Q_slopes : Array, shape (n, n), (n, n, shared)
        Covariance of the process noise of a sample.
    variance : Array, shape (p,)
        Of the measurement noise.
    P, P_slopes : Array, shape (n, n), (n, n, shared)
        Covariance of the predicted state of the first sample.
    """

    model: SampledModel
    Q: Array
    Q_slopes: Array
    variance: Array
    P: Array
    P_slopes: Array

    @classmethod
    def of_known_noise(
        cls, model: SampledModel, Q: Array, variance: Array, P: Array
    ) -> FilterEquations:
        """Return equations whose unknowns do not move the noise, nor what a state does."""
        none = np.zeros((*P.shape, 0))
        return cls(model=model, Q=Q, Q_slopes=none, variance=variance, P=P, P_slopes=none)


@dataclass(frozen=True, slots=True)
class SequentialInnovations:
    """Innovations of one maneuver, outputs of a sample taken in turn.

    Of what was not measured they are zero, their variance one.

    Attributes
    ----------
    e : Array, shape (samples, p)
        Measured less predicted from the samples before.
    independent, variance : Array, shape (samples, p)
        Innovations given the outputs before in the same sample too, and their variance.
    by_independent, by_variance : Array, shape (samples, p, L), (samples, p, shared)
        Slopes of the innovations over their deviation, and of the variance over itself.
    """

    e: Array
    independent: Array
    variance: Array
    by_independent: Array
    by_variance: Array

    @property
    def white(self) -> Array:
        """Innovations of unit variance, (samples, p)."""
        return self.whitened(self.independent)

    @property
    def cost(self) -> float:
        """Negative log likelihood, up to a constant."""
        return 0.5 * float(np.sum(self.white**2 + np.log(self.variance)))

    def whitened(self, innovations: Array) -> Array:
        """Return innovations such as `independent` with unit variance."""
        return np.asarray(innovations / np.sqrt(self.variance))

    def slopes(self, columns: IntArray) -> InnovationSlopes:
        """Return slopes by these unknowns, those first that the variance depends on, (L,).

        Of an innovation w of variance s, given those before, the information is dw dw / s + ds ds /
        (2 s^2) (Klein & Morelli, Aircraft System Identification, ch. 6).
        """
        spread = self.by_variance.reshape(-1, self.by_variance.shape[2])
        return InnovationSlopes(
            by_white=self.by_independent,
            columns=columns,
            information=0.5 * spread.T @ spread,
            score=-0.5 * spread.T @ (1.0 - self.white.ravel() ** 2),
            shared=columns[: spread.shape[1]],
        )


def filter_intermittent(
    equations: FilterEquations, drive: Array, maneuver: Maneuver
) -> SequentialInnovations | None:
    """Run the filter over one maneuver; None if it fails.

    Parameters
    ----------
    equations : FilterEquations
    drive : Array, shape (samples, w)
    maneuver : Maneuver
        Its outputs, and at which samples each was measured.
    """
    q, s, measured = equations, equations.model, maneuver.outputs
    size = measured.shape
    found = SequentialInnovations(
        e=np.zeros(size),
        independent=np.zeros(size),
        variance=np.ones(size),
        by_independent=np.zeros((*size, s.by_start.shape[1])),
        by_variance=np.zeros((*size, q.P_slopes.shape[2])),
    )
    done = _filter(
        s.step, s.by_step, s.read, s.by_read, q.Q, q.Q_slopes, q.variance, s.start.copy(),
        s.by_start.copy(), q.P.copy(), q.P_slopes.copy(), drive, measured,
        maneuver.seen, found.e, found.independent, found.variance,
        found.by_independent, found.by_variance,
    )  # fmt: skip
    return found if done and np.isfinite(found.cost) else None


@compiled_part
def innovation_variance(
    P: Array,
    P_slopes: Array,
    h: Array,
    by_h: Array,
    variance: float,
    noise: int,
    Ph: Array,
    by_Ph: Array,
    by_spread: Array,
) -> float:
    """Return the variance h' P h + `variance` of an output's innovation.

    `h` (n,) and `by_h` (n, L) are its row of C; column `noise` is the logarithm of its deviation.
    Overwritten are `Ph` (n,) by P h, `by_Ph` (n, shared) by its slopes, and `by_spread` (shared,)
    by slopes of the variance over itself.
    """
    n, shared = len(P), P_slopes.shape[2]
    spread = variance
    for a in range(n):
        Ph[a] = 0.0
        for b in range(n):
            Ph[a] += P[a, b] * h[b]
        spread += h[a] * Ph[a]
    if not spread > 0.0:
        return spread
    for q in range(shared):
        by_spread[q] = 0.0
    for a in range(n):
        for q in range(shared):
            by_Ph[a, q] = 0.0
        for b in range(n):
            for q in range(shared):
                by_Ph[a, q] += P_slopes[a, b, q] * h[b] + P[a, b] * by_h[b, q]
        for q in range(shared):
            by_spread[q] += h[a] * by_Ph[a, q] + by_h[a, q] * Ph[a]
    if shared:
        by_spread[noise] += 2.0 * variance
    for q in range(shared):
        by_spread[q] /= spread
    return spread


@compiled_part
def take_output(
    x: Array,
    by_x: Array,
    P: Array,
    P_slopes: Array,
    h: Array,
    by_h: Array,
    left: float,
    by_left: Array,
    variance: float,
    noise: int,
    Ph: Array,
    by_Ph: Array,
    by_spread: Array,
) -> float:
    """Correct state and covariance by one output; return the variance of its innovation `left`.

    `by_left` (L,) is overwritten by slopes over the deviation; else as `innovation_variance`.
    """
    n, shared = len(x), P_slopes.shape[2]
    spread = innovation_variance(P, P_slopes, h, by_h, variance, noise, Ph, by_Ph, by_spread)
    if not spread > 0.0:
        return spread
    for a in range(n):
        gain = Ph[a] / spread
        x[a] += gain * left
        for q in range(len(by_left)):
            by_x[a, q] += gain * by_left[q]
        for q in range(shared):
            by_x[a, q] += (by_Ph[a, q] / spread - gain * by_spread[q]) * left
        for b in range(n):
            P[a, b] -= gain * Ph[b]
            for q in range(shared):
                P_slopes[a, b, q] -= (
                    gain * by_Ph[b, q] + by_Ph[a, q] * Ph[b] / spread - gain * Ph[b] * by_spread[q]
                )
    for q in range(len(by_left)):
        by_left[q] /= np.sqrt(spread)
    return spread


@compiled_part
def covariance_ahead(
    P: Array,
    P_slopes: Array,
    step: Array,
    by_step: Array,
    Q: Array,
    Q_slopes: Array,
    G: Array,
    by_G: Array,
) -> None:
    """Overwrite P and its slopes by F P F' + Q; `G` (n, n) and `by_G` (n, n, shared) are work."""
    n, shared = len(P), P_slopes.shape[2]
    # G = P F'; by_G = P_slopes F' / 2 + P by_F': F by_G and its transpose are all.
    for i in range(n):
        for b in range(n):
            G[i, b] = 0.0
            for q in range(shared):
                by_G[i, b, q] = 0.0
            for c in range(n):
                G[i, b] += P[i, c] * step[b, c]
                half = 0.5 * step[b, c]
                for q in range(shared):
                    by_G[i, b, q] += half * P_slopes[i, c, q] + P[i, c] * by_step[b, c, q]
    for a in range(n):
        for b in range(n):
            P[a, b] = Q[a, b]
            for q in range(shared):
                P_slopes[a, b, q] = Q_slopes[a, b, q]
            for i in range(n):
                P[a, b] += step[a, i] * G[i, b]
                for q in range(shared):
                    P_slopes[a, b, q] += step[a, i] * by_G[i, b, q] + step[b, i] * by_G[i, a, q]


@compiled_part
def state_ahead(x: Array, by_x: Array, step: Array, by_step: Array, z: Array, T: Array) -> None:
    """Overwrite the state and its slopes by those of the next sample.

    `z` (n + w,) has the drive behind the first n, which are overwritten; `T` (n, L) is work.
    """
    n, wide = step.shape
    for i in range(n):
        z[i] = x[i]
        for q in range(T.shape[1]):
            T[i, q] = by_x[i, q]
    for i in range(n):
        x[i] = 0.0
        for q in range(T.shape[1]):
            by_x[i, q] = 0.0
        for c in range(wide):
            x[i] += step[i, c] * z[c]
            for q in range(T.shape[1]):
                by_x[i, q] += by_step[i, c, q] * z[c]
        for c in range(n):
            for q in range(T.shape[1]):
                by_x[i, q] += step[i, c] * T[c, q]


@compiled_part
def output_at(
    x: Array, by_x: Array, drive: Array, h: Array, by_h: Array, by_innovation: Array
) -> float:
    """Return an output; its slopes are taken off those of its innovation, `by_innovation` (L,).

    `h` (n + w,) and `by_h` (n + w, L) are its rows by state and drive.
    """
    n, total, y = len(x), len(by_innovation), 0.0
    for c in range(len(h)):
        value = x[c] if c < n else drive[c - n]
        y += h[c] * value
        for q in range(total):
            by_innovation[q] -= by_h[c, q] * value
            if c < n:
                by_innovation[q] -= h[c] * by_x[c, q]
    return y


@compiled
def _filter(
    step: Array,
    by_step: Array,
    read: Array,
    by_read: Array,
    Q: Array,
    Q_slopes: Array,
    variance: Array,
    x: Array,
    by_x: Array,
    P: Array,
    P_slopes: Array,
    drive: Array,
    measured: Array,
    sampled: BoolArray,
    e: Array,
    independent: Array,
    spread: Array,
    by_independent: Array,
    by_spread: Array,
) -> bool:
    """Filter one maneuver; return whether every state stayed below `STATE_LIMIT`."""
    n, wide = step.shape
    p, total, shared = len(variance), by_x.shape[1], P_slopes.shape[2]
    z, T = np.zeros(wide), np.zeros((n, total))
    Ph, by_Ph = np.zeros(n), np.zeros((n, shared))
    G, by_G = np.zeros((n, n)), np.zeros((n, n, shared))
    for k in range(len(drive)):
        for i in range(n):
            z[i] = x[i]
            if not abs(x[i]) < STATE_LIMIT:
                return False
        z[n:] = drive[k]
        for j in range(p):
            if sampled[k, j]:
                e[k, j] = measured[k, j]
                for c in range(wide):
                    e[k, j] -= read[j, c] * z[c]
        for j in range(p):
            if not sampled[k, j]:
                continue
            by_left = by_independent[k, j]
            left = measured[k, j] - output_at(x, by_x, z[n:], read[j], by_read[j], by_left)
            independent[k, j] = left
            spread[k, j] = take_output(
                x, by_x, P, P_slopes, read[j, :n], by_read[j, :n], left, by_left, variance[j],
                shared - p + j, Ph, by_Ph, by_spread[k, j],
            )  # fmt: skip
            if not spread[k, j] > 0.0:
                return False
        state_ahead(x, by_x, step, by_step, z, T)
        covariance_ahead(P, P_slopes, step, by_step, Q, Q_slopes, G, by_G)
    return True
