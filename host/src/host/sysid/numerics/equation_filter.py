"""The Kalman filter of a user's equations, extended; parameters may be states of it.

A template as those of `equation_recursion`: `rate_slopes` and `reading_slopes` are placeholders.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.compiled import compiled_part
from host.sysid.expressions.equation_code import of_equations
from host.sysid.numerics.equation_recursion import (
    add_columns,
    add_jumps,
    end_of_step,
    multiply,
    rate_slopes,
    rates,
    reading_slopes,
    take_held,
)
from host.sysid.numerics.fractional_delay import delayed_at
from host.sysid.numerics.kalman_filter import filter_with
from host.sysid.numerics.recursion import STATE_LIMIT

SERIES_ORDER = 4  # of the transition over a step, as of the step itself


class EquationModel(NamedTuple):
    """Equations of one maneuver: what the filter takes. Its state is n states, then constants.

    Attributes
    ----------
    intensity : Array, shape (n,)
        Spectral density of the noise in each rate.
    inputs, held, late
        As `inputs`, `held` and `shift` of `SampledEquations`.
    p, c, t : Array
        Parameters, constants, tables.
    column : IntArray, shape (parameters,)
        Entry of the state that is this parameter; -1 where it is known. The same for what follows.
    bias, bias_column
        Added to the rates, (n,).
    offset, offset_column
        Added to the outputs, (outputs,).
    delay_s, delay_column
        Delay of each output, s.
    leader : IntArray, shape (outputs,)
        First output with the same delay.
    input_column : IntArray, shape (m,)
        Entry of the state that is the delay of this input; -1 where `inputs` are as late as they
        are.
    dt_s, substeps, ramp
        As of `SampledEquations`.
    """

    intensity: Array
    inputs: Array
    held: Array
    late: Array
    p: Array
    column: IntArray
    c: Array
    t: Array
    bias: Array
    bias_column: IntArray
    offset: Array
    offset_column: IntArray
    delay_s: Array
    delay_column: IntArray
    leader: IntArray
    input_column: IntArray
    dt_s: float
    substeps: int
    ramp: float


@compiled_part
def known_at(z: Array, column: IntArray, values: Array) -> Array:
    """Return values, of which those that are unknowns stand in the state."""
    found = values.copy()
    for j in range(len(column)):
        if column[j] >= 0:
            found[j] = z[column[j]]
    return found


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
    """Return the input at a share of the step behind sample `k`."""
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


@compiled_part
def transition(fx: Array, B: Array, h: float, S: Array) -> None:
    """Overwrite `S` (n, L) by the slopes of the states after `h` seconds by those before.

    A series of the slopes of the rates by states, `fx` (n, n), and by all, `B` (n, L).
    """
    n, L = B.shape
    E = B.copy()
    for order in range(SERIES_ORDER, 1, -1):
        multiply(fx, E, S)
        for i in range(n):
            for b in range(L):
                E[i, b] = B[i, b] + h / order * S[i, b]
    for i in range(n):
        for b in range(L):
            S[i, b] = h * E[i, b]
        S[i, i] += 1.0


@of_equations
def step_along(
    m: EquationModel,
    p: Array,
    bias: Array,
    x: Array,
    h: float,
    u: Array,
    by_delay: Array,
    f: Array,
    fx: Array,
    S: Array,
) -> None:
    """Step the states by `h` seconds, which may be negative.

    `S` (n, L) is overwritten by their slopes by states and unknowns before the step, from those of
    the rates in its middle, which are left in `fx` (n, n). `u` (3, m) are the inputs at begin,
    middle and end, `by_delay` (m,) their slopes in the middle by their delay; the rates at the end
    are left in `f` (n,).
    """
    n, L = S.shape
    stage, total, B = x.copy(), np.zeros(n), np.zeros((n, L))
    fu, fp = np.zeros((n, u.shape[1])), np.zeros((n, len(m.column)))
    for number in range(4):
        at = (number + 1) // 2
        if number == 1:
            rate_slopes(stage, u[at], p, m.c, m.t, f, fx, fu, fp)
        else:
            rates(stage, u[at], p, m.c, m.t, f)
        weight = 1.0 if number == 0 or number == 3 else 2.0
        ahead = h if number == 2 else 0.5 * h
        for i in range(n):
            f[i] += bias[i]
            total[i] += weight * f[i]
            stage[i] = x[i] + ahead * f[i]
    for i in range(n):
        x[i] += h / 6.0 * total[i]
        if m.bias_column[i] >= 0:
            B[i, m.bias_column[i]] = 1.0
    for a in range(n):
        for b in range(n):
            B[a, b] = fx[a, b]
    fu *= by_delay
    add_columns(fp, m.column, B)
    add_columns(fu, m.input_column, B)
    transition(fx, B, h, S)


@compiled_part
def spread_ahead(P: Array, S: Array, fx: Array, intensity: Array, h: float) -> None:
    """Overwrite the covariance `P` by that after a step, process noise added by Simpson's rule."""
    n, L = S.shape
    G, half = np.empty((n, L)), np.empty(n)
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


@of_equations
def state_when_measured(
    m: EquationModel, k: int, j: int, ago_s: float, z: Array, p: Array, shift: Array, S: Array
) -> Array:
    """Return the states that output `j` tells of; their slopes by the state are left in `S` (n, L).

    What is measured at sample `k` was true `ago_s` ago: one step back along the equations.
    """
    n = len(S)
    back, delay = z[:n].copy(), m.delay_column[j]
    if ago_s == 0.0 and delay < 0:
        S[:, :] = 0.0
        for i in range(n):
            S[i, i] = 1.0
        return back
    u, by_shift = np.zeros((3, len(shift))), np.zeros((3, len(shift)))
    for part in range(3):
        position = k - 0.5 * part * ago_s / m.dt_s
        input_at(m.inputs, position, shift, m.input_column, m.ramp, u[part], by_shift[part])
    f, bias = np.zeros(n), known_at(z, m.bias_column, m.bias)
    step_along(m, p, bias, back, -ago_s, u, by_shift[1] / m.dt_s, f, np.zeros((n, n)), S)
    if delay >= 0:
        for i in range(n):
            S[i, delay] -= f[i]
    return back


@of_equations
def equation_outputs(
    m: EquationModel,
    k: int,
    seen: BoolArray,
    z: Array,
    by_x: Array,
    y: Array,
    by_y: Array,
    H: Array,
    by_H: Array,
) -> None:
    """Write outputs as `kalman_filter.outputs_at`; there are no slopes by unknowns."""
    n, L, inputs, outputs = len(m.bias), len(z), m.inputs.shape[1], len(y)
    p, shift = known_at(z, m.column, m.p), known_at(z / m.dt_s, m.input_column, m.late)
    offset = known_at(z, m.offset_column, m.offset)
    delay_s = known_at(z, m.delay_column, m.delay_s)
    S, reached, unused = np.zeros((n, L)), np.zeros((outputs, L)), np.zeros(inputs)
    u, by_shift, rate = np.zeros(inputs), np.zeros(inputs), np.zeros(inputs)
    own, yx = np.zeros(outputs), np.zeros((outputs, n))
    yu, yp = np.zeros((outputs, inputs)), np.zeros((outputs, len(m.column)))
    for j in range(outputs):
        if m.leader[j] != j:
            continue
        position, delay = k - delay_s[j] / m.dt_s, m.delay_column[j]
        back = state_when_measured(m, k, j, delay_s[j], z, p, shift, S)
        input_at(m.inputs, position, shift, m.input_column, m.ramp, u, by_shift)
        reading_slopes(back, u, p, m.c, m.t, own, yx, yu, yp)
        multiply(yx, S, reached)
        add_columns(yp, m.column, reached)
        if delay >= 0:
            # An output that an input drives at once sees that input later too.
            input_rate(m.inputs, position, shift, m.input_column, m.ramp, rate, unused, by_shift)
            for i in range(outputs):
                for b in range(inputs):
                    reached[i, delay] -= yu[i, b] * rate[b] / m.dt_s
            input_at(m.inputs, position, shift, m.input_column, m.ramp, u, by_shift)
        add_columns(yu * by_shift / m.dt_s, m.input_column, reached)
        for i in range(outputs):
            if m.leader[i] == j:
                y[i] = own[i] + offset[i]
                for b in range(L):
                    H[i, b] = reached[i, b]
                if m.offset_column[i] >= 0:
                    H[i, m.offset_column[i]] += 1.0


@of_equations
def equation_step(
    m: EquationModel, k: int, z: Array, by_x: Array, P: Array, P_slopes: Array
) -> bool:
    """Step as `kalman_filter.step_ahead`, in steps that end at samples and where inputs jump."""
    n, L, inputs = len(m.bias), len(z), m.inputs.shape[1]
    p, bias = known_at(z, m.column, m.p), known_at(z, m.bias_column, m.bias)
    shift = known_at(z / m.dt_s, m.input_column, m.late)
    u, by_shift, work = np.zeros((3, inputs)), np.zeros((3, inputs)), np.zeros((2, n))
    f, fx, S = np.zeros(n), np.zeros((n, n)), np.zeros((n, L))
    position, whole = 0.0, 0
    while whole < m.substeps:
        boundary = (whole + 1.0) / m.substeps
        end = end_of_step(position, boundary, shift, m.ramp)
        h = (end - position) * m.dt_s
        for part in range(3):
            if m.ramp == 0.0:
                take_held(m.held, k + 0.5 * (position + end), shift, u[part])
            else:
                share = position + 0.5 * part * (end - position)
                input_within(
                    m.inputs, k, share, shift, m.input_column, m.ramp, u[part], by_shift[part]
                )
        step_along(m, p, bias, z[:n], h, u, by_shift[1] / m.dt_s, f, fx, S)
        if m.ramp == 0.0:
            add_jumps(z[:n], k + end, m.held, shift, m.input_column, p, m.c, m.t, S, work, u[:2])
        spread_ahead(P, S, fx, m.intensity, h)
        position = end
        if end == boundary:
            whole += 1
    return bool(np.max(np.abs(z[:n])) < STATE_LIMIT)


filter_equations = filter_with(equation_outputs, equation_step)
