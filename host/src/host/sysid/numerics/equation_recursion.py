"""Runge-Kutta steps of a user's equations, and of the sensitivities of the states.

Templates: `rates`, `rate_slopes`, `readings` and `reading_slopes` are placeholders, in whose place
`EquationCode.loop` puts the functions of one model. The step is Runge's and Kutta's of fourth
order; sensitivities are the exact derivatives of that step, so a search sees the slope of the cost
that it is given (internal differentiation; Bock, in: Modelling of Chemical Reaction Systems, 1981).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from host.arrays import Array, IntArray
from host.compiled import compiled_part, part_by_arrays
from host.sysid.expressions.equation_code import of_equations
from host.sysid.numerics.recursion import STATE_LIMIT

SHORTEST = 1e-9  # of a sample: no step is
JUMP_OFFSET = 1e-6  # of a sample: before and behind a jump
# Stages of a step: weight, how late the inputs are, how far ahead of the begin the next stage is.
STAGES = ((1.0, 0.0, 0.5), (2.0, 0.5, 0.5), (2.0, 0.5, 1.0), (1.0, 1.0, 0.5))


class SampledEquations(NamedTuple):
    """Equations over the samples of one maneuver, by L unknowns: what the simulator takes.

    Attributes
    ----------
    start, by_start : Array, shape (n,), (n, L)
        State of the first sample and its slopes; without unknowns there are no slopes.
    inputs : Array, shape (samples, m)
        As late as they are: what outputs see, and rates where inputs move on a line.
    held : Array, shape (samples, m)
        Not yet late: what rates see where inputs are held.
    shift : Array, shape (m,)
        Samples that `held` is late by. A step ends where one jumps: spread over its sample, a
        command 30 ms late is found 34.5 ms late, of records of 20 and 40 ms a sample.
    by_delay : Array, shape (samples, m)
        Slopes of each input by its delay.
    input_column : IntArray, shape (m,)
        Unknown that is this delay; -1 for none.
    p, column : Array, IntArray, shape (parameters,)
        Parameters, and which unknown each is; -1 where it is known.
    c, t : Array
        Constants, tables.
    bias, bias_column : Array, IntArray, shape (n,)
        Added to the rates, and which unknown each is.
    dt_s : float
    substeps : int
        Steps from sample to sample.
    ramp : float
        Share of the way to the next sample that an input goes within a step: 1 is first-order hold,
        0 is zero-order hold.
    """

    start: Array
    by_start: Array
    inputs: Array
    held: Array
    shift: Array
    by_delay: Array
    input_column: IntArray
    p: Array
    column: IntArray
    c: Array
    t: Array
    bias: Array
    bias_column: IntArray
    dt_s: float
    substeps: int
    ramp: float


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


def _multiply(a: Array, b: Array, out: Array) -> None:
    out[...] = a @ b


@part_by_arrays(_multiply)
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
    take_held(held, position - JUMP_OFFSET, shift, u[0])
    take_held(held, position + JUMP_OFFSET, shift, u[1])
    for j in range(len(shift)):
        if input_column[j] < 0 or u[0, j] == u[1, j]:
            continue
        for side in range(2):  # one call: code of six degrees of freedom compiles for seconds
            rates(x, u[0], p, c, t, work[side])
            u[0, j] = u[1, j]
        for i in range(len(x)):
            S[i, input_column[j]] += work[0, i] - work[1, i]


def _add_columns(by: Array, column: IntArray, out: Array) -> None:
    for b in np.flatnonzero(column >= 0):
        out[:, column[b]] += by[:, b]


@part_by_arrays(_add_columns)
def add_columns(by: Array, column: IntArray, out: Array) -> None:
    """Add the columns of slopes `by` (rows, q) to those of the unknowns that they belong to."""
    for b in range(len(column)):
        if column[b] >= 0:
            for i in range(len(out)):
                out[i, column[b]] += by[i, b]


@compiled_part
def add_scaled(by: Array, scale: Array, column: IntArray, out: Array) -> None:
    """Do the same with each column `scale` (q,) times."""
    for b in range(len(column)):
        if column[b] >= 0:
            for i in range(len(out)):
                out[i, column[b]] += by[i, b] * scale[b]


@compiled_part
def take_stage_inputs(
    inputs: Array, by_delay: Array, k: int, share: float, ramp: float, u: Array, slope: Array
) -> None:
    """Write inputs a share of the way behind sample `k` into `u`, their slopes into `slope`.

    Where inputs are held, what their delay does is in the jumps.
    """
    for j in range(len(u)):
        u[j] = inputs[k, j] + ramp * share * (inputs[k + 1, j] - inputs[k, j])
        slope[j] = ramp * (by_delay[k, j] + share * (by_delay[k + 1, j] - by_delay[k, j]))


def _begin_step(begin: Array, x: Array, sum_: Array) -> None:
    if begin.shape[1] == 1:  # of the states alone loops are quicker
        begin_step.function(begin, x, sum_)
    else:
        x[...], sum_[...] = begin, 0.0


@part_by_arrays(_begin_step)
def begin_step(begin: Array, x: Array, sum_: Array) -> None:
    """Write the begin of a step (n, ...) into `x`, and no rates into their sum.

    A loop: to assign a slice compiles the text of an error too, 0.7 s each.
    """
    for i in range(len(x)):
        for j in range(x.shape[1]):
            x[i, j] = begin[i, j]
            sum_[i, j] = 0.0


def _add_rates(
    rate: Array, weight: float, ahead: float, begin: Array, sum_: Array, x: Array
) -> None:
    if rate.shape[1] == 1:
        add_rates.function(rate, weight, ahead, begin, sum_, x)
    else:
        sum_ += weight * rate
        x[...] = begin + ahead * rate


@part_by_arrays(_add_rates)
def add_rates(
    rate: Array, weight: float, ahead: float, begin: Array, sum_: Array, x: Array
) -> None:
    """Add rates (n, ...) to their weighted sum, and write the state `ahead` from the begin."""
    for i in range(len(x)):
        for j in range(x.shape[1]):
            sum_[i, j] += weight * rate[i, j]
            x[i, j] = begin[i, j] + ahead * rate[i, j]


def _add_times(factor: float, of: Array, out: Array) -> None:
    if of.shape[1] == 1:
        add_times.function(factor, of, out)
    else:
        out += factor * of


@part_by_arrays(_add_times)
def add_times(factor: float, of: Array, out: Array) -> None:
    """Add an array (n, ...) so many times."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] += factor * of[i, j]


@compiled_part
def add_ones(column: IntArray, out: Array) -> None:
    """Add one to the slope of each row by its own unknown."""
    for i in range(len(out)):
        if column[i] >= 0:
            out[i, column[i]] += 1.0


def run_equations(
    start: Array,
    by_start: Array,
    inputs: Array,
    held: Array,
    shift: Array,
    by_delay: Array,
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
    """Simulate states (samples, n), outputs (samples, p) and slopes of these (p, samples, L).

    The first arguments are those of `SampledEquations`; the last three are overwritten.

    Returns
    -------
    bool
        Whether every state stayed below `STATE_LIMIT`.
    """
    (n, L), m, q, outputs = by_start.shape, len(shift), len(column), y.shape[1]
    state, stage, total, f = np.zeros((4, n, 1))
    for i in range(n):
        state[i, 0] = start[i]
    S, T, total_S, K = np.zeros((4, n, L))
    add_times(1.0, by_start, S)
    u, slope = np.zeros(m), np.zeros(m)
    fx, fu, fp = np.zeros((n, n)), np.zeros((n, m)), np.zeros((n, q))
    yx, yu, yp = np.zeros((outputs, n)), np.zeros((outputs, m)), np.zeros((outputs, q))
    work, after = np.zeros((2, n)), np.zeros((2, m))
    for k in range(len(inputs)):
        for i in range(n):
            if not abs(state[i, 0]) < STATE_LIMIT:
                return False
            x[k, i] = state[i, 0]
        if L == 0:
            readings(state[:, 0], inputs[k], p, c, t, y[k])
        else:
            reading_slopes(state[:, 0], inputs[k], p, c, t, y[k], yx, yu, yp)
            multiply(yx, S, slopes[:, k, :])
            add_columns(yp, column, slopes[:, k, :])
            add_scaled(yu, by_delay[k], input_column, slopes[:, k, :])
        position, whole = 0.0, 0
        while whole < substeps and k < len(inputs) - 1:
            end = end_of_step(position, (whole + 1.0) / substeps, shift, ramp)
            h = (end - position) * dt_s
            begin_step(state, stage, total)
            if L > 0:
                begin_step(S, T, total_S)
            for number in range(4):
                weight, late, ahead = STAGES[number]
                share = position + late * (end - position)
                take_stage_inputs(inputs, by_delay, k, share, ramp, u, slope)
                if ramp == 0.0:
                    take_held(held, k + 0.5 * (position + end), shift, u)
                if L == 0:
                    rates(stage[:, 0], u, p, c, t, f[:, 0])
                else:
                    rate_slopes(stage[:, 0], u, p, c, t, f[:, 0], fx, fu, fp)
                    multiply(fx, T, K)
                    add_columns(fp, column, K)
                    add_scaled(fu, slope, input_column, K)
                    add_ones(bias_column, K)
                    add_rates(K, weight, ahead * h, S, total_S, T)
                for i in range(n):
                    f[i, 0] += bias[i]
                add_rates(f, weight, ahead * h, state, total, stage)
            add_times(h / 6.0, total, state)
            if L > 0:
                add_times(h / 6.0, total_S, S)
                if ramp == 0.0:
                    add_jumps(
                        state[:, 0], k + end, held, shift, input_column, p, c, t, S, work, after
                    )
            whole += 1 if end == (whole + 1.0) / substeps else 0
            position = end
    return True
