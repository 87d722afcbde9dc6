"""What inputs could drive in an output: inputs at many lags, and the modelled motion itself.

A residual that these columns explain is not noise. Lags are taken by hat functions whose knots
double, so that a few columns reach from one sample to seconds.
"""

from __future__ import annotations

import numpy as np

from host.arrays import Array

FIRST_KNOT_S, LONGEST_S = 0.05, 3.2
LAG_SHARE = 0.25  # of the shortest record: a longer memory is not seen often enough


def lag_knots_s(dt_s: float, shortest_s: float) -> Array:
    """Return the knots of the lags, s: 0, then doubling.

    Parameters
    ----------
    dt_s : float
        Sample period; no knot is nearer to zero.
    shortest_s : float
        Of the records.
    """
    longest_s = min(LONGEST_S, LAG_SHARE * shortest_s)
    knots = [0.0, max(FIRST_KNOT_S, dt_s)]
    while 2.0 * knots[-1] <= longest_s:
        knots.append(2.0 * knots[-1])
    return np.array(knots)


def input_regressors(inputs: Array, modelled: Array, dt_s: float, knots_s: Array) -> Array:
    """Return columns that the inputs drive, (samples, inputs x knots + 3 x modelled).

    Parameters
    ----------
    inputs : Array, shape (samples, m)
        Before the record they stood where they begin.
    modelled : Array, shape (samples, k)
        Simulated outputs: an error of a slow mode lasts longer than any lag. Their squares, with
        and without sign, stand for what is not linear.
    dt_s : float
    knots_s : Array
        Of `lag_knots_s`.
    """
    samples = len(inputs)
    lag_s = np.arange(int(np.ceil(knots_s[-1] / dt_s)) + 1) * dt_s
    hats = np.array([np.interp(lag_s, knots_s, row) for row in np.eye(len(knots_s))])
    hats[:, lag_s > knots_s[-1] + 1e-9] = 0.0
    columns = []
    for u in (inputs - inputs[0]).T:
        columns += [np.convolve(u, hat)[:samples] for hat in hats]
    y = modelled - modelled[0]
    return np.column_stack([*columns, y, y * y, y * np.abs(y)])
