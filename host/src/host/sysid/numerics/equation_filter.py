"""An extended Kalman filter of a user's equations; parameters may be states of it.

A template as those of `equation_recursion`: `rate_slopes` and `reading_slopes` are placeholders.
Measurements of an instant are taken one after another, which for uncorrelated noise is the same as
all at once, and leaves innovations that are independent of each other (Anderson & Moore, Optimal
Filtering, 1979, sec. 6.4).
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.compiled import compiled_part
from host.sysid.numerics.equation_recursion import (
    STATE_LIMIT,
    rate_slopes,
    reading_slopes,
)


@compiled_part
def input_at(inputs: Array, position: float, ramp: float, u: Array) -> None:
    """Write the inputs at a time, in samples, into `u`; before the first they are the first."""
    last = len(inputs) - 1
    k = min(max(int(np.floor(position)), 0), last)
    share = ramp * min(max(position - k, 0.0), 1.0)
    ahead = min(k + 1, last)
    for j in range(inputs.shape[1]):
        u[j] = inputs[k, j] + share * (inputs[ahead, j] - inputs[k, j])


@compiled_part
def multiply(a: Array, b: Array, out: Array) -> None:
    """Write a b into `out`; of so small matrices a tenth of what `numpy.dot` takes."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            out[i, j] = 0.0
        for k in range(a.shape[1]):
            x = a[i, k]
            if x != 0.0:
                for j in range(b.shape[1]):
                    out[i, j] += x * b[k, j]


def filter_equations(
    z: Array,
    P: Array,
    lower: Array,
    upper: Array,
    intensity: Array,
    variance: Array,
    inputs: Array,
    measured: Array,
    seen: BoolArray,
    p: Array,
    column: IntArray,
    c: Array,
    t: Array,
    bias: Array,
    bias_column: IntArray,
    offset: Array,
    offset_column: IntArray,
    delay_s: Array,
    delay_column: IntArray,
    leader: IntArray,
    dt_s: float,
    substeps: int,
    ramp: float,
    e: Array,
    white: Array,
    power: Array,
) -> bool:
    """Filter one maneuver.

    Parameters
    ----------
    z, P : Array, shape (L,), (L, L)
        Predicted at the first sample: n states, then unknowns that are constant. Overwritten by
        those after the last.
    lower, upper : Array, shape (L,)
        Bounds of the unknowns.
    intensity : Array, shape (n,)
        Spectral density of the noise in each rate.
    variance : Array, shape (outputs,)
        Of the measurement noise.
    inputs : Array, shape (samples, m)
    measured, seen : Array, shape (samples, outputs)
        What was measured, and whether.
    p, c, t : Array
        Parameters, constants, tables.
    column : IntArray, shape (parameters,)
        Entry of `z` that is this parameter; -1 where it is known. The same for what follows.
    bias, bias_column
        Added to the rates, (n,).
    offset, offset_column
        Added to the outputs, (outputs,).
    delay_s, delay_column
        Of each output, s.
    leader : IntArray, shape (outputs,)
        First output with the same delay.
    dt_s, substeps, ramp
        As of `simulate_equations`.
    e : Array, shape (samples, outputs)
        Overwritten: measured less predicted from the samples before.
    white, power : Array, shape (samples, outputs)
        Overwritten: innovations given the outputs before in the same sample too, and their
        variance; 0 and 1 where nothing was measured.

    Returns
    -------
    bool
        Whether every state stayed below `STATE_LIMIT`.
    """
    n, L, m, outputs, q = len(bias), len(z), inputs.shape[1], measured.shape[1], len(column)
    p, bias, offset, delay_s = p.copy(), bias.copy(), offset.copy(), delay_s.copy()
    u, f, stage, sum_, back = np.zeros(m), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    fx, fu, fp = np.zeros((n, n)), np.zeros((n, m)), np.zeros((n, q))
    y, yx = np.zeros(outputs), np.zeros((outputs, n))
    yu, yp = np.zeros((outputs, m)), np.zeros((outputs, q))
    S, T, K, sum_S = np.zeros((n, L)), np.zeros((n, L)), np.zeros((n, L)), np.zeros((n, L))
    first, half, reached = np.zeros((n, n)), np.zeros((n, n)), np.zeros((outputs, L))
    H, G, change, PH = np.zeros((outputs, L)), np.zeros((n, L)), np.zeros(L), np.zeros(L)
    h = dt_s / substeps
    for k in range(len(inputs)):
        for i in range(n):
            if not abs(z[i]) < STATE_LIMIT:
                return False
        for j in range(q):
            if column[j] >= 0:
                p[j] = z[column[j]]
        for j in range(outputs):
            if offset_column[j] >= 0:
                offset[j] = z[offset_column[j]]
            if delay_column[j] >= 0:
                delay_s[j] = z[delay_column[j]]
        for i in range(n):
            if bias_column[i] >= 0:
                bias[i] = z[bias_column[i]]
        H[:, :] = 0.0
        for j in range(outputs):
            if leader[j] != j:
                continue
            S[:, :] = 0.0
            for i in range(n):
                back[i] = z[i]
                S[i, i] = 1.0
            late = delay_s[j]
            input_at(inputs, k - late / dt_s, ramp, u)
            if late != 0.0 or delay_column[j] >= 0:
                # What is measured now was true `late` ago: one step back along the equations.
                stage[:] = back
                T[:, :] = S
                sum_[:] = 0.0
                sum_S[:, :] = 0.0
                for number in range(4):
                    share = 0.0 if number == 0 else (1.0 if number == 3 else 0.5)
                    input_at(inputs, k - share * late / dt_s, ramp, u)
                    rate_slopes(stage, u, p, c, t, f, fx, fu, fp)
                    multiply(fx, T, K)
                    for i in range(q):
                        if column[i] >= 0:
                            K[:, column[i]] += fp[:, i]
                    for i in range(n):
                        if bias_column[i] >= 0:
                            K[i, bias_column[i]] += 1.0
                    weight = 1.0 if number == 0 or number == 3 else 2.0
                    ahead = -late if number == 2 else -0.5 * late
                    for i in range(n):
                        sum_[i] += weight * (f[i] + bias[i])
                        stage[i] = back[i] + ahead * (f[i] + bias[i])
                    sum_S += weight * K
                    T[:, :] = S + ahead * K
                for i in range(n):
                    back[i] -= late / 6.0 * sum_[i]
                S -= late / 6.0 * sum_S
                if delay_column[j] >= 0:
                    for i in range(n):
                        S[i, delay_column[j]] -= f[i] + bias[i]
            reading_slopes(back, u, p, c, t, y, yx, yu, yp)
            multiply(yx, S, reached)
            for i in range(outputs):
                if leader[i] != j:
                    continue
                e[k, i] = measured[k, i] - y[i] - offset[i]
                for b in range(L):
                    H[i, b] = reached[i, b]
                for b in range(q):
                    if column[b] >= 0:
                        H[i, column[b]] += yp[i, b]
                if offset_column[i] >= 0:
                    H[i, offset_column[i]] += 1.0
        change[:] = 0.0
        for j in range(outputs):
            white[k, j], power[k, j] = 0.0, 1.0
            if not seen[k, j]:
                e[k, j] = 0.0
                continue
            left, spread = e[k, j], variance[j]
            for a in range(L):
                PH[a] = 0.0
                for b in range(L):
                    PH[a] += P[a, b] * H[j, b]
                left -= H[j, a] * change[a]
                spread += H[j, a] * PH[a]
            if not spread > 0.0:
                return False
            white[k, j], power[k, j] = left, spread
            for a in range(L):
                change[a] += PH[a] * left / spread
                for b in range(L):
                    P[a, b] -= PH[a] * PH[b] / spread
        for a in range(L):
            z[a] = min(max(z[a] + change[a], lower[a]), upper[a])
        if k == len(inputs) - 1:
            break
        for j in range(q):
            if column[j] >= 0:
                p[j] = z[column[j]]
        for i in range(n):
            if bias_column[i] >= 0:
                bias[i] = z[bias_column[i]]
        for s in range(substeps):
            S[:, :] = 0.0
            for i in range(n):
                stage[i] = z[i]
                sum_[i] = 0.0
                S[i, i] = 1.0
            T[:, :] = S
            sum_S[:, :] = 0.0
            for number in range(4):
                late = 0.0 if number == 0 else (1.0 if number == 3 else 0.5)
                share = ramp * (s + late) / substeps
                for j in range(m):
                    u[j] = inputs[k, j] + share * (inputs[k + 1, j] - inputs[k, j])
                rate_slopes(stage, u, p, c, t, f, fx, fu, fp)
                if number == 0:
                    first[:, :] = fx
                multiply(fx, T, K)
                for j in range(q):
                    if column[j] >= 0:
                        K[:, column[j]] += fp[:, j]
                for i in range(n):
                    if bias_column[i] >= 0:
                        K[i, bias_column[i]] += 1.0
                weight = 1.0 if number == 0 or number == 3 else 2.0
                ahead = h if number == 2 else 0.5 * h
                for i in range(n):
                    sum_[i] += weight * (f[i] + bias[i])
                    stage[i] = z[i] + ahead * (f[i] + bias[i])
                sum_S += weight * K
                T[:, :] = S + ahead * K
            for i in range(n):
                z[i] += h / 6.0 * sum_[i]
            S += h / 6.0 * sum_S
            # Only the states move: P becomes [S; 0 1] P [S; 0 1]'.
            multiply(S, P, G)
            for a in range(n):
                for b in range(n, L):
                    P[a, b] = G[a, b]
                    P[b, a] = G[a, b]
            # Noise of the step by Simpson's rule; the transition over its half is a series.
            multiply(first, first, half)
            for a in range(n):
                for b in range(n):
                    half[a, b] = 0.125 * h * h * half[a, b] + 0.5 * h * first[a, b]
                half[a, a] += 1.0
            for a in range(n):
                for b in range(n):
                    added = intensity[a] if a == b else 0.0
                    for i in range(n):
                        added += intensity[i] * (S[a, i] * S[b, i] + 4.0 * half[a, i] * half[b, i])
                    P[a, b] = h / 6.0 * added
                    for i in range(L):
                        P[a, b] += G[a, i] * S[b, i]
    return True
