"""Noise that outputs share: what it adds to the covariance of a score that sums over all of them.

A gust moves every output: beta and ay go together by -0.8 there, the bank angle follows the roll
rate. Output error weighs outputs as if their noises were independent; a score that two of them show
then varies by twice what it says. Each output is whitened by a model of its own, so that what they
share is a correlation over a few lags (Newey & West, Econometrica 55, 1987).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from host.arrays import Array

# Means: a gust that rolls the aircraft reaches the roll rate at once, the bank angle two later.
LONGEST_LAG = 3


def shared_noise_covariance(
    noise: Sequence[Sequence[Array]], columns: Sequence[Sequence[Array]]
) -> Array:
    """Return what noise between outputs adds to the covariance of sums of columns' times noise.

    Parameters
    ----------
    noise : sequence of sequence of Array, shape (samples,)
        Innovations of each output in each maneuver, of variance one.
    columns : sequence of sequence of Array, shape (samples, k)
        What each is summed with, in the same units.

    Returns
    -------
    Array, shape (k, k)
    """
    total = np.zeros((columns[0][0].shape[1],) * 2)
    samples = sum(len(e) for e in noise[0])
    for (first, early), (second, late) in combinations(zip(noise, columns, strict=True), 2):
        for lag in range(-LONGEST_LAG, LONGEST_LAG + 1):
            correlation = sum(float(a @ b) for a, b in _lagged(first, second, lag)) / samples
            taper = 1.0 - abs(lag) / (LONGEST_LAG + 1)  # Bartlett's, for a positive variance
            product = sum(a.T @ b for a, b in _lagged(early, late, lag))
            total += taper * correlation * (product + np.transpose(product))
    return total


def _lagged(
    first: Sequence[Array], second: Sequence[Array], lag: int
) -> Iterator[tuple[Array, Array]]:
    """Yield rows of the first with rows of the second that are `lag` later."""
    for a, b in zip(first, second, strict=True):
        n = len(a) - abs(lag)
        if n > 0:
            yield a[max(-lag, 0) :][:n], b[max(lag, 0) :][:n]
