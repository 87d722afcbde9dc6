"""Loops over samples, compiled: discretisation with exact sensitivities, response, delay, AR.

Arrays with sensitivities keep the parameter as last axis, so that the inner loop is a vector
operation; outputs come first, so that each output is one contiguous block for BLAS.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array, IntArray
from host.compiled import compiled

TAYLOR_ORDER = 14  # 0.5^15 / 15! = 2e-17: below double precision for a scaled norm of 0.5
SCALED_NORM = 0.5
TAYLOR_END = 1e-17  # norm^k / k!: terms from here on change no bit
BLOCK = 64  # samples: 64 lines of 96 slopes are 48 kB
STATE_LIMIT = 1e8  # a trial response beyond it is called divergent


@compiled
def _product(left: Array, slopes: Array, n_states: int, factor: float, out: Array) -> None:
    """Put factor * left[:n, :n] @ slopes into `out`, for every parameter at once."""
    for i in range(n_states):
        for j in range(slopes.shape[1]):
            for q in range(slopes.shape[2]):
                out[i, j, q] = 0.0
            for c in range(n_states):
                f = left[i, c] * factor
                if f != 0.0:
                    for q in range(slopes.shape[2]):
                        out[i, j, q] += f * slopes[c, j, q]


@compiled
def _square(left: Array, right: Array, factor: float, out: Array) -> None:
    """Put factor * left @ right into `out`; a call of BLAS costs more than these few products."""
    size = len(left)
    for i in range(size):
        for j in range(size):
            value = 0.0
            for c in range(size):
                value += left[i, c] * right[c, j]
            out[i, j] = value * factor


@compiled
def transition(
    AB: Array,
    n_states: int,
    n_inputs: int,
    foh: bool,
    dt_s: float,
    row: IntArray,
    column: IntArray,
    parameter: IntArray,
    gain: Array,
    n_parameters: int,
) -> tuple[Array, Array]:
    """Discretise [A B b] and its derivatives by one block exponential (Taylor, squaring).

    Returns the transition [Phi Gamma] of shape (n, n + w) and its derivatives
    (n, n + w, parameters); w = inputs + 1, or 2 inputs + 1 with inputs running linearly.
    """
    wide = n_states + n_inputs + 1
    size = wide + n_inputs if foh else wide
    M = np.zeros((size, size))
    M[:n_states, :wide] = AB * dt_s
    if foh:
        for i in range(n_inputs):
            M[n_states + i, wide + i] = 1.0
    norm = 0.0
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += abs(M[i, j])
        norm = max(norm, total)
    squarings = 0
    while norm > SCALED_NORM and squarings < 40:
        norm *= 0.5
        squarings += 1
    scale = 0.5**squarings
    M *= scale
    E = np.eye(size)
    power = np.eye(size)
    spare = np.zeros((size, size))
    # Rows below the states never depend on a parameter, and one entry of [A B b] moves one row:
    # 0.03 ms for 24 parameters, against 0.25 with a full product for each of them.
    slopes = np.zeros((n_states, size, n_parameters))
    dpower = np.zeros((n_states, size, n_parameters))
    fresh = np.zeros((n_states, size, n_parameters))
    term = 1.0
    for order in range(1, TAYLOR_ORDER + 1):
        part = 1.0 / order
        _product(M, dpower, n_states, part, fresh)
        for t in range(len(row)):
            f = gain[t] * dt_s * scale * part
            for j in range(size):
                fresh[row[t], j, parameter[t]] += f * power[column[t], j]
        dpower, fresh = fresh, dpower
        slopes += dpower
        _square(M, power, part, spare)
        power, spare = spare, power
        E += power
        term *= norm * part
        if term < TAYLOR_END:
            break
    for _ in range(squarings):
        _product(E, slopes, n_states, 1.0, fresh)
        for i in range(n_states):
            for j in range(size):
                for c in range(size):
                    f = E[c, j]
                    if f != 0.0:
                        for q in range(n_parameters):
                            fresh[i, j, q] += f * slopes[i, c, q]
        slopes, fresh = fresh, slopes
        _square(E, E, 1.0, spare)
        E, spare = spare, E
    return E[:n_states].copy(), slopes


@compiled
def simulate(step: Array, drive: Array, start: Array) -> tuple[bool, Array]:
    """Run the states; returns whether they stayed finite and [x, drive] of each sample."""
    samples, w = drive.shape
    n = start.shape[0]
    z = np.zeros((samples, n + w))
    for i in range(n):
        z[0, i] = start[i]
    for k in range(samples):
        for j in range(w):
            z[k, n + j] = drive[k, j]
        if k + 1 == samples:
            break
        for i in range(n):
            value = 0.0
            for j in range(n + w):
                value += step[i, j] * z[k, j]
            if not (abs(value) < STATE_LIMIT):
                return False, z
            z[k + 1, i] = value
    return True, z


@compiled
def propagate(
    step: Array, step_slopes: Array, z: Array, C: Array, start_slopes: Array, out: Array
) -> None:
    """Run the state sensitivities and map them to the outputs.

    Parameters
    ----------
    step : Array, shape (n, n + w)
        Transition; its first n columns act on sensitivities.
    step_slopes : Array, shape (n, n + w, parameters)
        Derivatives of the transition.
    z : Array, shape (samples, n + w)
        State and drive of each sample.
    C : Array, shape (p, n)
    start_slopes : Array, shape (n, parameters)
        Sensitivities of the start state.
    out : Array, shape (p, samples, parameters)
        Overwritten with the sensitivities of the outputs.
    """
    samples, wide = z.shape
    n, _, free = step_slopes.shape
    p = C.shape[0]
    flat = np.empty((wide, n * free))
    for i in range(n):
        for c in range(wide):
            for q in range(free):
                flat[c, i * free + q] = step_slopes[i, c, q]
    # What drives the sensitivities is made block by block and stays in the cache: 0.23 ms for
    # 24 parameters and 2000 samples, 0.43 with the whole drive laid down first.
    push = np.empty((BLOCK, n * free))
    S = start_slopes.copy()
    T = np.zeros((n, free))
    for begin in range(0, samples, BLOCK):
        count = min(BLOCK, samples - begin)
        np.dot(z[begin : begin + count], flat, push[:count])
        for b in range(count):
            for j in range(p):
                line = out[j, begin + b]
                for q in range(free):
                    line[q] = 0.0
                for i in range(n):
                    c = C[j, i]
                    if c != 0.0:
                        for q in range(free):
                            line[q] += c * S[i, q]
            if n == 4:  # one pass over memory instead of four
                for i in range(4):
                    s0, s1, s2, s3 = step[i, 0], step[i, 1], step[i, 2], step[i, 3]
                    for q in range(free):
                        T[i, q] = (
                            s0 * S[0, q]
                            + s1 * S[1, q]
                            + s2 * S[2, q]
                            + s3 * S[3, q]
                            + push[b, i * free + q]
                        )
            else:
                for i in range(n):
                    for q in range(free):
                        T[i, q] = push[b, i * free + q]
                    for j in range(n):
                        f = step[i, j]
                        for q in range(free):
                            T[i, q] += f * S[j, q]
            S, T = T, S


@compiled
def delayed(values: Array, shift: float) -> tuple[Array, Array]:
    """Delay each column by `shift` samples with cubic interpolation; second result: d/dshift.

    `values` is (samples, columns). The first samples lean on the nearest four.
    """
    samples, columns = values.shape
    out = np.zeros((samples, columns))
    slope = np.zeros((samples, columns))
    for k in range(samples):
        position = k - shift
        base = int(np.floor(position))
        base = min(max(base, 1), samples - 3)
        s = position - base
        c0 = -s * (s - 1.0) * (s - 2.0) / 6.0
        c1 = (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0
        c2 = -(s + 1.0) * s * (s - 2.0) / 2.0
        c3 = (s + 1.0) * s * (s - 1.0) / 6.0
        d0 = -(3.0 * s * s - 6.0 * s + 2.0) / 6.0
        d1 = (3.0 * s * s - 4.0 * s - 1.0) / 2.0
        d2 = -(3.0 * s * s - 2.0 * s - 2.0) / 2.0
        d3 = (3.0 * s * s - 1.0) / 6.0
        for c in range(columns):
            v0 = values[base - 1, c]
            v1 = values[base, c]
            v2 = values[base + 1, c]
            v3 = values[base + 2, c]
            out[k, c] = c0 * v0 + c1 * v1 + c2 * v2 + c3 * v3
            slope[k, c] = -(d0 * v0 + d1 * v1 + d2 * v2 + d3 * v3)
    return out, slope


@compiled
def ar_filter(values: Array, coefficient: Array, head: Array) -> Array:
    """Whiten columns by an AR filter: e[k] = v[k] - sum a_l v[k-l], first samples by `head`.

    `head` (order, order) is the inverse Cholesky factor of the covariance of `order` successive
    samples in units of the innovation, which makes the whitening exact from the first sample.
    """
    samples, columns = values.shape
    order = len(coefficient)
    out = np.empty((samples, columns))
    for k in range(samples):
        line = out[k]
        if k < order:
            for c in range(columns):
                line[c] = 0.0
            for i in range(k + 1):
                h = head[k, i]
                for c in range(columns):
                    line[c] += h * values[i, c]
        else:
            for c in range(columns):
                line[c] = values[k, c]
            for i in range(order):
                a = coefficient[i]
                for c in range(columns):
                    line[c] -= a * values[k - 1 - i, c]
    return out
