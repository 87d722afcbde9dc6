"""Recursion x[k+1] = F x[k] + G z[k] of the states and of their sensitivities.

A loop over samples is slow in an interpreter. The record is therefore cut into about as many pieces
as each has samples; all pieces run side by side from rest, then the response to the initial state
of each is added. The same loop as machine code takes a fifth of the time (1.1 against 0.23 ms for
24 parameters, 4 states and 2000 samples), but a process pays 0.4 s to load it and a fresh install
1.2 s to compile it. One flight's maneuvers do not save that time; a study does within seconds and
asks for it (`prefer_machine_code`).
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array
from host.compiled import compiled
from host.sysid.numerics.discretisation import powers_of

STATE_LIMIT = 1e8  # a response beyond it has diverged
WORTH_COMPILING = 1.5e7  # 0.1 s of numpy ten times a search, in values of states and slopes
OVERHEAD = 100  # the same, what a sample costs besides them
BLOCK = 256  # samples: the input of 96 sensitivities over one block is 200 kB


def simulate(step: Array, drive: Array, start: Array) -> tuple[bool, Array]:
    """Simulate the states.

    Parameters
    ----------
    step : Array, shape (n, n + w)
        [Phi Gamma].
    drive : Array, shape (samples, w)
    start : Array, shape (n,)

    Returns
    -------
    bool
        Whether every state stayed below `STATE_LIMIT`.
    Array, shape (samples, n + w)
        State and drive of each sample.
    """
    n = len(start)
    x = np.empty((n, len(drive), 1))
    propagate(step, step[:, n:, None], drive, np.eye(n), start[:, None], x)
    z = np.hstack([x[:, :, 0].T, drive])
    return bool(np.max(np.abs(z[:, :n]), initial=0.0) < STATE_LIMIT), z


def propagate(
    step: Array, step_derivatives: Array, z: Array, C: Array, start_sensitivities: Array, out: Array
) -> None:
    """Run the sensitivity equations of the states and map them to the outputs.

    S[k+1] = F S[k] + sum over c of z_c[k] dstep_c, out[k] = C S[k] (EQUATIONS.md,
    eq. 25).

    Parameters
    ----------
    step : Array, shape (n, n + w)
        [Phi Gamma]; the first n columns act on sensitivities.
    step_derivatives : Array, shape (n, wide, parameters)
        Derivatives of `step`: they drive the sensitivities with each sample's row of `z`.
    z : Array, shape (samples, wide)
        State and drive of each sample.
    C : Array, shape (p, n)
    start_sensitivities : Array, shape (n, parameters)
        Sensitivities of the initial state.
    out : Array, shape (p, samples, parameters)
        Overwritten with the sensitivities of the outputs.
    """
    samples, wide = z.shape
    n, _, free = step_derivatives.shape
    if not propagate_block.pays(samples * (n * free + OVERHEAD), WORTH_COMPILING):
        out[...] = _in_pieces(step[:, :n], step_derivatives, z, C, start_sensitivities)
        return
    F = np.ascontiguousarray(step[:, :n])
    C = np.ascontiguousarray(C)
    flat = np.ascontiguousarray(step_derivatives.transpose(1, 0, 2)).reshape(wide, n * free)
    # The input of the recursion is computed block by block and stays in the cache.
    forcing = np.empty((min(BLOCK, samples), n * free))
    S, T = start_sensitivities.copy(), np.empty_like(start_sensitivities)
    with np.errstate(over="ignore", invalid="ignore"):  # of a model that diverges
        for begin in range(0, samples, BLOCK):
            count = min(BLOCK, samples - begin)
            np.dot(z[begin : begin + count], flat, out=forcing[:count])
            propagate_block(F, C, S, T, forcing, begin, count, out)


@compiled
def propagate_block(
    F: Array, C: Array, S: Array, T: Array, forcing: Array, begin: int, count: int, out: Array
) -> None:
    """Run `count` samples from `begin`; S holds the state sensitivities before and after.

    The parameter is the last axis: the inner loop is a vector operation.
    """
    n, free = S.shape
    for k in range(count):
        for j in range(C.shape[0]):
            for q in range(free):
                out[j, begin + k, q] = 0.0
            for i in range(n):
                f = C[j, i]
                if f != 0.0:
                    for q in range(free):
                        out[j, begin + k, q] += f * S[i, q]
        for i in range(n):
            for q in range(free):
                T[i, q] = forcing[k, i * free + q]
            for j in range(n):
                f = F[i, j]
                for q in range(free):
                    T[i, q] += f * S[j, q]
        for i in range(n):
            for q in range(free):
                S[i, q] = T[i, q]


def _in_pieces(F: Array, G: Array, z: Array, C: Array, start: Array) -> Array:
    """Return C S, shape (p, samples, P), with S[k+1] = F S[k] + sum over c of z[k, c] G[:, c].

    A state that overflows ends in infinity or NaN, which the caller checks for.
    """
    samples, wide = z.shape
    n, _, free = G.shape
    length = max(1, round(samples**0.5))
    pieces = -(-samples // length)
    rows = np.zeros((pieces * length, wide))
    rows[:samples] = z
    # Sample by sample, all pieces side by side in one product.
    rows = rows.reshape(pieces, length, wide).transpose(1, 0, 2).reshape(-1, wide)
    with np.errstate(over="ignore", invalid="ignore"):
        X = (rows @ G).reshape(n, length, pieces * free)
        for k in range(1, length):
            X[:, k] += F @ X[:, k - 1]
        powers = powers_of(F, length)
        ends = np.ascontiguousarray(X[:, -1].reshape(n, pieces, free).transpose(1, 0, 2))
        begins = np.empty((pieces, n, free))
        begins[0] = start
        for k in range(1, pieces):
            begins[k] = powers[-1] @ begins[k - 1] + ends[k - 1]
        first = begins.transpose(1, 0, 2).reshape(n, -1)
        lines = (C @ powers[:-1]).transpose(1, 0, 2).reshape(-1, n)
        out = (lines @ first).reshape(len(C), length, pieces * free)
        out[:, 1:] += (C @ X[:, :-1].reshape(n, -1)).reshape(len(C), length - 1, pieces * free)
    in_order = out.reshape(len(C), length, pieces, free).transpose(0, 2, 1, 3)
    return np.asarray(in_order.reshape(len(C), pieces * length, free)[:, :samples])
