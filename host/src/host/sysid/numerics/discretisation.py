"""Discretise a continuous linear system, with exact derivatives by its parameters."""

from __future__ import annotations

from math import factorial

import numpy as np

from host.arrays import Array, IntArray

TAYLOR_ORDER = 14  # 0.5^15 / 15! = 2e-17: below double precision for a scaled norm of 0.5
SCALED_NORM = 0.5
MOST_SQUARINGS = 40
TAYLOR = np.array([1.0 / factorial(k) for k in range(TAYLOR_ORDER + 1)])
# The derivative of M^k / k! is the sum of M^a dM M^b / k! over a + b = k - 1; hence the weight
# 1 / (a + b + 1)! of a and b.
BOTH_SIDES = np.array(
    [
        [TAYLOR[a + b + 1] if a + b < TAYLOR_ORDER else 0.0 for b in range(TAYLOR_ORDER)]
        for a in range(TAYLOR_ORDER)
    ]
)


def discretise(
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
    """Discretise [A B b] and its derivatives.

    The block exponential exp([[A, B], [0, 0]] dt) = [[Phi, Gamma], [0, I]] (EQUATIONS.md, eq. 23)
    is computed by scaling, a Taylor series and
    squaring; a first-order hold adds integrators for the increments of the inputs.

    Parameters
    ----------
    AB : Array, shape (n, n + inputs + 1)
        Per second; the last column is a constant rate.
    n_states, n_inputs : int
    foh : bool
        Whether inputs run linearly between samples (first-order hold); zero-order hold otherwise.
    dt_s : float
        Sample period, s.
    row, column, parameter : IntArray, shape (entries,)
        Which entry of `AB` depends on which parameter.
    gain : Array, shape (entries,)
        Derivative of the entry by the parameter.
    n_parameters : int

    Returns
    -------
    Array, shape (n, n + w)
        [Phi Gamma]; w = inputs + 1, or 2 inputs + 1 with a first-order hold, whose last `inputs`
        columns act on the increments.
    Array, shape (n, n + w, parameters)
        Its derivatives by the parameters.
    """
    wide = n_states + n_inputs + 1
    size = wide + n_inputs if foh else wide
    M = np.zeros((size, size))
    M[:n_states, :wide] = AB * dt_s
    if foh:
        ramp = np.arange(n_inputs)
        M[n_states + ramp, wide + ramp] = 1.0
    norm = float(np.max(np.sum(np.abs(M), axis=1)))
    squarings = 0
    while norm > SCALED_NORM and squarings < MOST_SQUARINGS:
        norm *= 0.5
        squarings += 1
    scale = 0.5**squarings
    slopes = np.zeros((n_states, size, n_parameters))
    # A search may try parameters far away; the caller refuses what is no longer finite.
    with np.errstate(over="ignore", invalid="ignore"):
        powers = powers_of(M * scale, TAYLOR_ORDER)
        E = (TAYLOR @ powers.reshape(len(TAYLOR), -1)).reshape(size, size)
        if n_parameters:
            # Rows below the states never depend on a parameter.
            left = powers[:-1, :n_states, :n_states].reshape(TAYLOR_ORDER, -1)
            right = powers[:-1].reshape(TAYLOR_ORDER, -1)
            by_entry = (left.T @ (BOTH_SIDES @ right)).reshape(n_states, n_states, size, size)
            entry_to_parameter = np.zeros((len(row), n_parameters))
            entry_to_parameter[np.arange(len(row)), parameter] = gain * (dt_s * scale)
            slopes = by_entry[:, row, column].transpose(0, 2, 1) @ entry_to_parameter
        for _ in range(squarings):
            if n_parameters:
                above = E[:n_states, :n_states] @ slopes.reshape(n_states, -1)
                slopes = above.reshape(slopes.shape) + E.T @ slopes
            E = E @ E
    return E[:n_states].copy(), slopes


def powers_of(M: Array, highest: int) -> Array:
    """Return M^0 to M^highest (1 or more), by doubling, shape (highest + 1, n, n)."""
    powers = np.empty((highest + 1, *M.shape))
    powers[0], powers[1] = np.eye(len(M)), M
    known = 1
    # As above: of an unstable trial high powers overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        while known < highest:
            more = min(known, highest - known)
            np.matmul(powers[known], powers[1 : more + 1], out=powers[known + 1 : known + more + 1])
            known += more
    return powers
