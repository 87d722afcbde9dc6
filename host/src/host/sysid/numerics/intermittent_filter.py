"""The Kalman filter of a linear model whose outputs are measured at some of the samples only.

Its matrices are constant and exact; slopes by the unknowns run along (Jategaonkar, Flight Vehicle
System Identification, 2nd ed., ch. 5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.compiled import compiled, compiled_part
from host.sysid.models.maneuver import Maneuver
from host.sysid.numerics.innovation_problem import InnovationSlopes
from host.sysid.numerics.kalman_filter import filter_with
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
        Variance of the measurement noise.
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

    What was not measured has innovation zero, of variance one.

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

    @classmethod
    def unfilled(cls, samples: int, outputs: int, total: int, shared: int) -> SequentialInnovations:
        """Return those of nothing measured, for a filter to write into."""
        size = samples, outputs
        return cls(
            e=np.zeros(size),
            independent=np.zeros(size),
            variance=np.ones(size),
            by_independent=np.zeros((*size, total)),
            by_variance=np.zeros((*size, shared)),
        )

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

        An innovation w of variance s, given those before, has the information dw dw / s + ds ds /
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
    q, s = equations, equations.model
    n, shared = len(q.P), q.P_slopes.shape[2]
    samples, outputs = maneuver.outputs.shape
    total = s.by_start.shape[1]
    found = SequentialInnovations.unfilled(samples, outputs, total, shared)
    no_limit = np.full(n, np.inf)
    H, by_H = (np.ascontiguousarray(x[:, :n]) for x in (s.read, s.by_read))
    done = _filter(
        ConstantModel(s.step, s.by_step, s.read, s.by_read, q.Q, q.Q_slopes, drive),
        s.start.copy(), s.by_start.copy(), q.P.copy(), q.P_slopes.copy(), H, by_H,
        -no_limit, no_limit, q.variance, maneuver.outputs, maneuver.seen, found.by_independent,
        found.by_variance, found.e, found.independent, found.variance,
    )  # fmt: skip
    return found if done and np.isfinite(found.cost) else None


class ConstantModel(NamedTuple):
    """A `SampledModel`, its process noise and what drives it: what the filter takes."""

    step: Array
    by_step: Array
    read: Array
    by_read: Array
    Q: Array
    Q_slopes: Array
    drive: Array


@compiled_part
def constant_outputs(
    model: ConstantModel,
    k: int,
    seen: BoolArray,
    x: Array,
    by_x: Array,
    y: Array,
    by_y: Array,
    H: Array,
    by_H: Array,
) -> None:
    """Write outputs as `kalman_filter.outputs_at`; their slopes by the state stand there."""
    n, total = by_x.shape
    for j in range(len(y)):
        if not seen[j]:
            continue
        y[j] = 0.0
        by_y[j] = 0.0
        for c in range(model.read.shape[1]):
            value = x[c] if c < n else model.drive[k, c - n]
            y[j] += model.read[j, c] * value
            for q in range(total):
                by_y[j, q] += model.by_read[j, c, q] * value
                if c < n:
                    by_y[j, q] += model.read[j, c] * by_x[c, q]


@compiled_part
def constant_step(
    model: ConstantModel, k: int, x: Array, by_x: Array, P: Array, P_slopes: Array
) -> bool:
    """Step as `kalman_filter.step_ahead`."""
    n, total = by_x.shape
    before, by_before = x.copy(), by_x.copy()
    x[:] = 0.0
    by_x[:] = 0.0
    for i in range(n):
        for c in range(model.step.shape[1]):
            value = before[c] if c < n else model.drive[k, c - n]
            x[i] += model.step[i, c] * value
            for q in range(total):
                by_x[i, q] += model.by_step[i, c, q] * value
                if c < n:
                    by_x[i, q] += model.step[i, c] * by_before[c, q]
    covariance_ahead(P, P_slopes, model.step, model.by_step, model.Q, model.Q_slopes)
    return bool(np.max(np.abs(x)) < STATE_LIMIT)


@compiled_part
def covariance_ahead(
    P: Array,
    P_slopes: Array,
    step: Array,
    by_step: Array,
    Q: Array,
    Q_slopes: Array,
) -> None:
    """Overwrite P and its slopes by F P F' + Q."""
    n, shared = len(P), P_slopes.shape[2]
    G, by_G = np.empty((n, n)), np.empty((n, n, shared))
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


_filter = compiled(filter_with(constant_outputs, constant_step))
