"""Which derivative costs how much bandwidth: what exact knowledge of it would give back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.control.scenarios import Problem, draw
from host.control.uncertain_axis import UncertainAxis

DRAWN, SEED = 60, 7_000
LEAST_SHARE = 0.02  # of the crossover: less is within what 60 aircraft tell


def bandwidth_costs(problem: Problem, gains: Mapping[str, float]) -> list[tuple[str, float]]:
    """Return moment derivatives and the share of crossover that each costs, the largest first.

    The same aircraft are drawn again with one derivative known: their worst gain margin grows, and
    every gain may grow with it. To first order the crossover follows the gain.

    Parameters
    ----------
    problem : Problem
    gains : mapping of str to float
        By role, as designed.
    """

    def worst_db(axis: UncertainAxis) -> float:
        seen = draw(replace(problem, axis=axis), seed=SEED, count=DRAWN)
        return min(float(np.min(one.gain_db)) for one in seen.judged(gains))

    axis = problem.axis
    now = worst_db(axis)
    found = []
    for k, name in enumerate(axis.names):
        if name[0] in "LM" and axis.covariance[k, k] > 0.0:
            gained_db = worst_db(replace(axis, covariance=known(axis.covariance, k))) - now
            found.append((name, 10.0 ** (gained_db / 20.0) - 1.0))
    costly = [one for one in found if one[1] >= LEAST_SHARE]
    return sorted(costly, key=lambda one: -one[1])


def known(covariance: Array, k: int) -> Array:
    """Return the covariance of the others where one of them is known exactly (Schur complement)."""
    column = covariance[:, k]
    return np.asarray(covariance - np.outer(column, column) / covariance[k, k])
