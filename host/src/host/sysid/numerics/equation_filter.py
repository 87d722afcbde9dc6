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
from host.sysid.expressions.equation_code import of_equations
from host.sysid.numerics.equation_recursion import (
    STATE_LIMIT,
    add_jumps,
    end_of_step,
    multiply,
    rate_slopes,
    rates,
    reading_slopes,
    take_held,
)
from host.sysid.numerics.fractional_delay import delayed_at

SERIES_ORDER = 4  # of the transition over a step, as of the step itself


@compiled_part
def input_at(
    inputs: Array,
    position: float,
    shift: Array,
    input_column: IntArray,
    ramp: float,
    u: Array,
    by_shift: Array,
) -> None:
    """Write the inputs at a time, in samples, into `u`; before the first they are the first.

    Those whose delay is unknown are `shift` samples late; `by_shift` is their slope by it, else 0.
    All are (m,).
    """
    k = min(max(int(np.floor(position)), 0), len(inputs) - 1)
    share = min(max(position - k, 0.0), 1.0)
    input_within(inputs, k, share, shift, input_column, ramp, u, by_shift)


@compiled_part
def input_within(
    inputs: Array,
    k: int,
    share: float,
    shift: Array,
    input_column: IntArray,
    ramp: float,
    u: Array,
    by_shift: Array,
) -> None:
    """Do the same for a share of the step behind sample `k`."""
    ahead = min(k + 1, len(inputs) - 1)
    for j in range(inputs.shape[1]):
        here, there, slope, slope_there = inputs[k, j], inputs[ahead, j], 0.0, 0.0
        if input_column[j] >= 0:
            here, slope = delayed_at(inputs[:, j], k, shift[j])
            there, slope_there = delayed_at(inputs[:, j], ahead, shift[j])
        u[j] = here + ramp * share * (there - here)
        by_shift[j] = slope + ramp * share * (slope_there - slope)


@compiled_part
def input_rate(
    inputs: Array,
    position: float,
    shift: Array,
    input_column: IntArray,
    ramp: float,
    rate: Array,
    begin: Array,
    unused: Array,
) -> None:
    """Write into `rate` (m,) how fast the inputs move before a time, in samples, per sample.

    `begin` and `unused` (m,) are work, all else as of `input_at`.
    """
    k = int(np.ceil(position)) - 1
    if k < 0 or k >= len(inputs) - 1:
        rate[:] = 0.0
        return
    input_within(inputs, k, 0.0, shift, input_column, ramp, begin, unused)
    input_within(inputs, k, 1.0, shift, input_column, ramp, rate, unused)
    for j in range(inputs.shape[1]):
        rate[j] -= begin[j]


@of_equations
def step_along(
    x: Array,
    h: float,
    u: Array,
    by_delay: Array,
    p: Array,
    c: Array,
    t: Array,
    bias: Array,
    column: IntArray,
    bias_column: IntArray,
    input_column: IntArray,
    work: Array,
    fx: Array,
    fu: Array,
    fp: Array,
    B: Array,
    E: Array,
    S: Array,
) -> None:
    """Step the states by `h` seconds, which may be negative.

    `S` (n, L) is overwritten by their slopes by states and unknowns before the step, a series of
    the slopes of the rates in its middle, which are left in `fx`. `u` (3, m) are the inputs at
    begin, middle and end, `by_delay` (m,) their slopes in the middle by their delay; `work` (3, n)
    is left with the rates at the end in row 0; `B` and `E` (n, L) are work.
    """
    n, L = S.shape
    f, stage, total = work[0], work[1], work[2]
    for i in range(n):
        stage[i] = x[i]
        total[i] = 0.0
    for number in range(4):
        at = (number + 1) // 2
        if number == 1:
            rate_slopes(stage, u[at], p, c, t, f, fx, fu, fp)
        else:
            rates(stage, u[at], p, c, t, f)
        weight = 1.0 if number == 0 or number == 3 else 2.0
        ahead = h if number == 2 else 0.5 * h
        for i in range(n):
            f[i] += bias[i]
            total[i] += weight * f[i]
            stage[i] = x[i] + ahead * f[i]
    for i in range(n):
        x[i] += h / 6.0 * total[i]
        for b in range(L):
            B[i, b] = fx[i, b] if b < n else 0.0
        for b in range(len(column)):
            if column[b] >= 0:
                B[i, column[b]] += fp[i, b]
        for b in range(len(input_column)):
            if input_column[b] >= 0:
                B[i, input_column[b]] += fu[i, b] * by_delay[b]
        if bias_column[i] >= 0:
            B[i, bias_column[i]] += 1.0
        for b in range(L):
            E[i, b] = B[i, b]
    for order in range(SERIES_ORDER, 1, -1):
        multiply(fx, E, S)
        for i in range(n):
            for b in range(L):
                E[i, b] = B[i, b] + h / order * S[i, b]
    for i in range(n):
        for b in range(L):
            S[i, b] = h * E[i, b]
        S[i, i] += 1.0


@compiled_part
def spread_ahead(
    P: Array, S: Array, fx: Array, intensity: Array, h: float, G: Array, half: Array
) -> None:
    """Overwrite the covariance `P` by that after a step, process noise added by Simpson's rule."""
    n, L = S.shape
    multiply(S, P, G)
    for a in range(n):
        for b in range(n, L):
            P[a, b] = G[a, b]
            P[b, a] = G[a, b]
        for b in range(n):
            P[a, b] = 0.0
            for i in range(L):
                P[a, b] += G[a, i] * S[b, i]
    for i in range(n):
        if intensity[i] == 0.0:
            continue
        # The transition over half of the step is a series too.
        for a in range(n):
            half[a] = 0.5 * h * fx[a, i]
            for b in range(n):
                half[a] += 0.125 * h * h * fx[a, b] * fx[b, i]
        half[i] += 1.0
        for a in range(n):
            for b in range(n):
                P[a, b] += h / 6.0 * intensity[i] * (S[a, i] * S[b, i] + 4.0 * half[a] * half[b])
        P[i, i] += h / 6.0 * intensity[i]


@compiled_part
def take_measurements(
    z: Array,
    P: Array,
    H: Array,
    variance: Array,
    seen: BoolArray,
    e: Array,
    white: Array,
    power: Array,
    change: Array,
    PH: Array,
) -> bool:
    """Correct states and covariance by the outputs of an instant; return whether P was sound."""
    L = len(z)
    change[:] = 0.0
    for j in range(len(e)):
        white[j], power[j] = 0.0, 1.0
        if not seen[j]:
            e[j] = 0.0
            continue
        left, spread = e[j], variance[j]
        for a in range(L):
            PH[a] = 0.0
            for b in range(L):
                PH[a] += P[a, b] * H[j, b]
            left -= H[j, a] * change[a]
            spread += H[j, a] * PH[a]
        if not spread > 0.0:
            return False
        white[j], power[j] = left, spread
        for a in range(L):
            change[a] += PH[a] * left / spread
            for b in range(L):
                P[a, b] -= PH[a] * PH[b] / spread
    for a in range(L):
        z[a] += change[a]
    return True


@compiled_part
def take_unknowns(z: Array, column: IntArray, values: Array) -> None:
    """Write the unknowns among the states into what they are values of."""
    for j in range(len(column)):
        if column[j] >= 0:
            values[j] = z[column[j]]


def filter_equations(
    z: Array,
    P: Array,
    lower: Array,
    upper: Array,
    intensity: Array,
    variance: Array,
    inputs: Array,
    held: Array,
    late: Array,
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
    input_column: IntArray,
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
    inputs, held, late
        As `inputs`, `held` and `shift` of `simulate_equations`.
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
    input_column : IntArray, shape (m,)
        Entry of `z` that is the delay of this input; -1 where `inputs` are as late as they are.
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
    u, by_shift, shift = np.zeros((3, m)), np.zeros((3, m)), late.copy()
    back, work, half = np.zeros(n), np.zeros((3, n)), np.zeros(n)
    fx, fu, fp = np.zeros((n, n)), np.zeros((n, m)), np.zeros((n, q))
    y, yx = np.zeros(outputs), np.zeros((outputs, n))
    yu, yp = np.zeros((outputs, m)), np.zeros((outputs, q))
    S, B, E, G = np.zeros((n, L)), np.zeros((n, L)), np.zeros((n, L)), np.zeros((n, L))
    reached, H = np.zeros((outputs, L)), np.zeros((outputs, L))
    change, PH = np.zeros(L), np.zeros(L)
    for k in range(len(inputs)):
        for i in range(n):
            if not abs(z[i]) < STATE_LIMIT:
                return False
        take_unknowns(z, column, p)
        take_unknowns(z, offset_column, offset)
        take_unknowns(z, delay_column, delay_s)
        take_unknowns(z, bias_column, bias)
        take_unknowns(z / dt_s, input_column, shift)
        H[:, :] = 0.0
        for j in range(outputs):
            if leader[j] != j:
                continue
            ago_s = delay_s[j]
            for i in range(n):
                back[i] = z[i]
            if ago_s != 0.0 or delay_column[j] >= 0:
                # What is measured now was true `ago_s` ago: one step back along the equations.
                for part in range(3):
                    input_at(
                        inputs, k - 0.5 * part * ago_s / dt_s, shift, input_column, ramp, u[part],
                        by_shift[part],
                    )  # fmt: skip
                step_along(
                    back, -ago_s, u, by_shift[1] / dt_s, p, c, t, bias, column, bias_column,
                    input_column, work, fx, fu, fp, B, E, S,
                )  # fmt: skip
                if delay_column[j] >= 0:
                    for i in range(n):
                        S[i, delay_column[j]] -= work[0, i]
            else:
                S[:, :] = 0.0
                for i in range(n):
                    S[i, i] = 1.0
            input_at(inputs, k - ago_s / dt_s, shift, input_column, ramp, u[2], by_shift[2])
            reading_slopes(back, u[2], p, c, t, y, yx, yu, yp)
            multiply(yx, S, reached)
            if delay_column[j] >= 0:
                # An output that an input drives at once sees that input later too.
                input_rate(
                    inputs, k - ago_s / dt_s, shift, input_column, ramp, u[0], u[1], by_shift[0]
                )
                for i in range(outputs):
                    for b in range(m):
                        reached[i, delay_column[j]] -= yu[i, b] * u[0, b] / dt_s
            for i in range(outputs):
                if leader[i] != j:
                    continue
                e[k, i] = measured[k, i] - y[i] - offset[i]
                for b in range(L):
                    H[i, b] = reached[i, b]
                for b in range(q):
                    if column[b] >= 0:
                        H[i, column[b]] += yp[i, b]
                for b in range(m):
                    if input_column[b] >= 0:
                        H[i, input_column[b]] += yu[i, b] * by_shift[2, b] / dt_s
                if offset_column[i] >= 0:
                    H[i, offset_column[i]] += 1.0
        if not take_measurements(z, P, H, variance, seen[k], e[k], white[k], power[k], change, PH):
            return False
        for a in range(L):
            z[a] = min(max(z[a], lower[a]), upper[a])
        if k == len(inputs) - 1:
            break
        take_unknowns(z, column, p)
        take_unknowns(z, bias_column, bias)
        take_unknowns(z / dt_s, input_column, shift)
        position, whole = 0.0, 0
        while whole < substeps:
            boundary = (whole + 1.0) / substeps
            end = end_of_step(position, boundary, shift, ramp)
            for part in range(3):
                if ramp == 0.0:
                    take_held(held, k + 0.5 * (position + end), shift, u[part])
                    by_shift[part] = 0.0
                else:
                    share = position + 0.5 * part * (end - position)
                    input_within(
                        inputs, k, share, shift, input_column, ramp, u[part], by_shift[part]
                    )
            step_along(
                z, (end - position) * dt_s, u, by_shift[1] / dt_s, p, c, t, bias, column,
                bias_column, input_column, work, fx, fu, fp, B, E, S,
            )  # fmt: skip
            if ramp == 0.0:
                add_jumps(z[:n], k + end, held, shift, input_column, p, c, t, S, work[:2], u[:2])
            spread_ahead(P, S, fx, intensity, (end - position) * dt_s, G, half)
            position = end
            if end == boundary:
                whole += 1
    return True
