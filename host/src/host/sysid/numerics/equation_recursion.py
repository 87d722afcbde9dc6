"""Runge-Kutta steps of a user's equations, and of the sensitivities of the states.

Templates: `rates`, `rate_slopes`, `readings` and `reading_slopes` are placeholders, in whose place
`EquationCode.loop` puts the functions of one model. The step is Runge's and Kutta's of fourth
order; sensitivities are the exact derivatives of that step, so a search sees the slope of the cost
that it is given (internal differentiation; Bock, in: Modelling of Chemical Reaction Systems, 1981).
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array, IntArray
from host.compiled import compiled_part
from host.sysid.expressions.equation_code import of_equations

STATE_LIMIT = 1e8  # a response beyond it has diverged
SHORTEST = 1e-9  # of a sample: no step is
BESIDE = 1e-6  # of a sample: before and behind a jump


def rates(x: Array, u: Array, p: Array, c: Array, t: Array, f: Array) -> None:
    """Write dx/dt into `f`; of a model."""
    raise NotImplementedError


def rate_slopes(
    x: Array, u: Array, p: Array, c: Array, t: Array, f: Array, fx: Array, fu: Array, fp: Array
) -> None:
    """Write dx/dt and its slopes by states, inputs and parameters."""
    raise NotImplementedError


def readings(x: Array, u: Array, p: Array, c: Array, t: Array, y: Array) -> None:
    """Write the outputs into `y`; of a model."""
    raise NotImplementedError


def reading_slopes(
    x: Array, u: Array, p: Array, c: Array, t: Array, y: Array, yx: Array, yu: Array, yp: Array
) -> None:
    """Write the outputs and their slopes."""
    raise NotImplementedError


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


@compiled_part
def end_of_step(position: float, boundary: float, shift: Array, ramp: float) -> float:
    """Return where a step from a position ends, in samples: at the boundary, or at a jump before.

    Inputs that are held and `shift` (m,) samples late jump between samples.
    """
    end = boundary
    if ramp == 0.0:
        for late in shift:
            jump = late - np.floor(late)
            if position + SHORTEST < jump < end - SHORTEST:
                end = jump
    return end


@compiled_part
def take_held(held: Array, position: float, shift: Array, u: Array) -> None:
    """Write inputs that are held and late into `u`; before the first sample they are the first."""
    for j in range(len(u)):
        row = int(np.floor(position - shift[j]))
        u[j] = held[min(max(row, 0), len(held) - 1), j]


@of_equations
def add_jumps(
    x: Array,
    position: float,
    held: Array,
    shift: Array,
    input_column: IntArray,
    p: Array,
    c: Array,
    t: Array,
    S: Array,
    work: Array,
    u: Array,
) -> None:
    """Add to the slopes `S` what the delays of inputs do that jump at a position.

    A jump that comes later leaves the rates before it for so long. `work` (2, n) and `u` (2, m) are
    work.
    """
    take_held(held, position - BESIDE, shift, u[0])
    take_held(held, position + BESIDE, shift, u[1])
    for j in range(len(shift)):
        if input_column[j] < 0 or u[0, j] == u[1, j]:
            continue
        for side in range(2):  # one call: code of six degrees of freedom compiles for seconds
            rates(x, u[0], p, c, t, work[side])
            u[0, j] = u[1, j]
        for i in range(len(x)):
            S[i, input_column[j]] += work[0, i] - work[1, i]


def simulate_equations(
    start: Array,
    inputs: Array,
    held: Array,
    shift: Array,
    p: Array,
    c: Array,
    t: Array,
    bias: Array,
    dt_s: float,
    substeps: int,
    ramp: float,
    x: Array,
    y: Array,
) -> bool:
    """Simulate states and outputs.

    Parameters
    ----------
    start : Array, shape (n,)
    inputs : Array, shape (samples, m)
        As late as they are: what outputs see, and rates where inputs move on a line.
    held : Array, shape (samples, m)
        Not yet late: what rates see where inputs are held.
    shift : Array, shape (m,)
        Samples that `held` is late by. A step ends where one jumps: spread over its sample, a
        command 30 ms late was found 34.5 ms late, of records of 20 and 40 ms a sample.
    p, c, t : Array
        Parameters, constants, tables.
    bias : Array, shape (n,)
        Added to the rates.
    dt_s : float
    substeps : int
        Steps from sample to sample.
    ramp : float
        Share of the way to the next sample that an input goes within a step: 1 is first-order hold,
        0 is zero-order hold.
    x : Array, shape (samples, n)
        Overwritten.
    y : Array, shape (samples, p)
        Overwritten.

    Returns
    -------
    bool
        Whether every state stayed below `STATE_LIMIT`.
    """
    n, m = len(start), inputs.shape[1]
    state, stage, sum_ = start.copy(), np.zeros(n), np.zeros(n)
    u, f = np.zeros(m), np.zeros(n)
    for k in range(len(inputs)):
        for i in range(n):
            if not abs(state[i]) < STATE_LIMIT:
                return False
            x[k, i] = state[i]
        readings(state, inputs[k], p, c, t, y[k])
        if k == len(inputs) - 1:
            break
        position, whole = 0.0, 0
        while whole < substeps:
            boundary = (whole + 1.0) / substeps
            end = end_of_step(position, boundary, shift, ramp)
            h = (end - position) * dt_s
            for i in range(n):
                stage[i] = state[i]
                sum_[i] = 0.0
            for number in range(4):
                late = 0.0 if number == 0 else (1.0 if number == 3 else 0.5)
                if ramp == 0.0:
                    take_held(held, k + 0.5 * (position + end), shift, u)
                else:
                    share = ramp * (position + late * (end - position))
                    for j in range(m):
                        u[j] = inputs[k, j] + share * (inputs[k + 1, j] - inputs[k, j])
                rates(stage, u, p, c, t, f)
                weight = 1.0 if number == 0 or number == 3 else 2.0
                ahead = h if number == 2 else 0.5 * h
                for i in range(n):
                    rate = f[i] + bias[i]
                    sum_[i] += weight * rate
                    stage[i] = state[i] + ahead * rate
            for i in range(n):
                state[i] += h / 6.0 * sum_[i]
            position = end
            if end == boundary:
                whole += 1
    return True


def simulate_with_slopes(
    start: Array,
    start_slopes: Array,
    inputs: Array,
    held: Array,
    shift: Array,
    input_slopes: Array,
    input_column: IntArray,
    p: Array,
    column: IntArray,
    c: Array,
    t: Array,
    bias: Array,
    bias_column: IntArray,
    dt_s: float,
    substeps: int,
    ramp: float,
    x: Array,
    y: Array,
    slopes: Array,
) -> bool:
    """Simulate states and outputs, and the sensitivities of the outputs.

    Parameters
    ----------
    start, inputs, held, shift, p, c, t, bias, dt_s, substeps, ramp, x, y
        As of `simulate_equations`.
    start_slopes : Array, shape (n, w)
        Of the initial state by each of w unknowns.
    input_slopes : Array, shape (samples, m)
        Of each input by its delay.
    input_column : IntArray, shape (m,)
        Unknown that is this delay; -1 for none.
    column : IntArray, shape (parameters,)
        Unknown that each parameter is; -1 where it is known.
    bias_column : IntArray, shape (n,)
        The same for `bias`.
    slopes : Array, shape (p, samples, w)
        Overwritten.
    """
    n, m, w = len(start), inputs.shape[1], start_slopes.shape[1]
    outputs, q = y.shape[1], len(column)
    state, stage, sum_ = start.copy(), np.zeros(n), np.zeros(n)
    S, T, sum_S, K = start_slopes.copy(), np.zeros((n, w)), np.zeros((n, w)), np.zeros((n, w))
    u, f = np.zeros(m), np.zeros(n)
    fx, fu, fp = np.zeros((n, n)), np.zeros((n, m)), np.zeros((n, q))
    yx, yu, yp = np.zeros((outputs, n)), np.zeros((outputs, m)), np.zeros((outputs, q))
    work, beside = np.zeros((2, n)), np.zeros((2, m))
    for k in range(len(inputs)):
        for i in range(n):
            if not abs(state[i]) < STATE_LIMIT:
                return False
            x[k, i] = state[i]
        reading_slopes(state, inputs[k], p, c, t, y[k], yx, yu, yp)
        multiply(yx, S, slopes[:, k, :])
        for j in range(q):
            if column[j] >= 0:
                slopes[:, k, column[j]] += yp[:, j]
        for j in range(m):
            if input_column[j] >= 0:
                slopes[:, k, input_column[j]] += yu[:, j] * input_slopes[k, j]
        if k == len(inputs) - 1:
            break
        position, whole = 0.0, 0
        while whole < substeps:
            boundary = (whole + 1.0) / substeps
            end = end_of_step(position, boundary, shift, ramp)
            h = (end - position) * dt_s
            for i in range(n):
                stage[i] = state[i]
                sum_[i] = 0.0
            T[:, :] = S
            sum_S[:, :] = 0.0
            for number in range(4):
                late = 0.0 if number == 0 else (1.0 if number == 3 else 0.5)
                share = ramp * (position + late * (end - position))
                if ramp == 0.0:
                    take_held(held, k + 0.5 * (position + end), shift, u)
                else:
                    for j in range(m):
                        u[j] = inputs[k, j] + share * (inputs[k + 1, j] - inputs[k, j])
                rate_slopes(stage, u, p, c, t, f, fx, fu, fp)
                multiply(fx, T, K)
                for j in range(q):
                    if column[j] >= 0:
                        K[:, column[j]] += fp[:, j]
                for j in range(m):
                    if input_column[j] >= 0 and ramp != 0.0:
                        slope = input_slopes[k, j]
                        slope += share * (input_slopes[k + 1, j] - slope)
                        K[:, input_column[j]] += fu[:, j] * slope
                for i in range(n):
                    if bias_column[i] >= 0:
                        K[i, bias_column[i]] += 1.0
                weight = 1.0 if number == 0 or number == 3 else 2.0
                ahead = h if number == 2 else 0.5 * h
                for i in range(n):
                    rate = f[i] + bias[i]
                    sum_[i] += weight * rate
                    stage[i] = state[i] + ahead * rate
                for i in range(n):
                    for j in range(w):
                        sum_S[i, j] += weight * K[i, j]
                        T[i, j] = S[i, j] + ahead * K[i, j]
            for i in range(n):
                state[i] += h / 6.0 * sum_[i]
            S += h / 6.0 * sum_S
            if ramp == 0.0:
                add_jumps(state, k + end, held, shift, input_column, p, c, t, S, work, beside)
            position = end
            if end == boundary:
                whole += 1
    return True
