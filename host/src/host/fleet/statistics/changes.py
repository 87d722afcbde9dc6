"""Has an aircraft changed? Each flight beside the aircraft's own first ones, and the likely cause.

A cause moves several derivatives in a pattern of its own. For each cause, and each of the last few
flights as the first of the change, its size is estimated by generalised least squares; that over
its standard deviation is the statistic (generalised likelihood ratio: Basseville & Nikiforov,
Detection of Abrupt Changes, ch. 2). The largest of all is held against the threshold. Errors that
an aircraft's flights share are in its first flights, too, and cancel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array

BASELINE = 8  # flights that say what the aircraft is
WINDOW = 4  # flights over which a change is looked for
# Of a hundred flights of unchanged aircraft 0.4 begin an alarm (`studies.fleet_changes`).
THRESHOLD = 3.75
_NEAR = 4.0  # of the square: a cause as near to the best is not ruled out
_MOVED = 2.0  # standard deviations


@dataclass(frozen=True, slots=True)
class Alarm:
    """What a flight says of a change.

    Attributes
    ----------
    flight : int
        Its number among the aircraft's flights, from 0.
    since : int
        The first flight of the change, as it seems.
    cause : str
        The likeliest.
    size : float
        Of the change, in the unit of its pattern.
    strength : float
        Size over its standard deviation.
    others : tuple of str
        Causes that explain it nearly as well.
    moved : tuple of int
        Places of the quantities that moved by more than two standard deviations, the surest first.
    """

    flight: int
    since: int
    cause: str
    size: float
    strength: float
    others: tuple[str, ...] = ()
    moved: tuple[int, ...] = ()


@dataclass(frozen=True)
class ChangeTest:
    """The test of one aircraft.

    Attributes
    ----------
    patterns : dict of str to (P,) Array
        By how much a cause of size 1 moves each derivative.
    spread : Array, shape (P,)
        Standard deviation between flights of an unchanged aircraft, from the whole type.
    rare : frozenset of str
        Causes that are named first only where no other explains a change nearly as well.
    """

    patterns: Mapping[str, Array]
    spread: Array
    rare: frozenset[str] = frozenset()

    def alarms(
        self, values: Sequence[Array], own: Sequence[Array], threshold: float = THRESHOLD
    ) -> list[Alarm]:
        """Return the flights whose statistic is above the threshold.

        Parameters
        ----------
        values : sequence of (P,) Array
            By date; the first `BASELINE` say what the aircraft is.
        own : sequence of (P, P) Array
            Covariance of each that its other flights do not share.
        """
        if len(values) <= BASELINE:
            return []
        flown = _Flown(np.stack(values), np.linalg.inv(np.stack(own) + np.diag(self.spread**2)))
        base = flown.mean(0, BASELINE)
        found = (self._strongest(flown, base, last) for last in range(BASELINE, len(values)))
        return [alarm for alarm in found if alarm.strength > threshold]

    def _strongest(self, flown: _Flown, base: tuple[Array, Array], last: int) -> Alarm:
        """Return the likeliest change that ends with a flight."""
        names = list(self.patterns)
        shapes = np.stack([self.patterns[name] for name in names], axis=1)
        best: Alarm | None = None
        for since in range(max(BASELINE, last - WINDOW + 1), last + 1):
            now, covariance = flown.mean(since, last + 1)
            covariance = covariance + base[1]
            weighed = np.linalg.solve(covariance, shapes)
            information = np.einsum("pc,pc->c", shapes, weighed)
            size = (now - base[0]) @ weighed / information
            strength = np.abs(size) * np.sqrt(information)
            k = self._named(names, strength)
            if best is None or float(strength[k]) > best.strength:
                near = [names[j] for j in np.argsort(-strength) if j != k and strength[j] ** 2
                        > strength[k] ** 2 - _NEAR]  # fmt: skip
                off = np.abs(now - base[0]) / np.sqrt(np.diag(covariance))
                moved = [int(j) for j in np.argsort(-off) if off[j] > _MOVED]
                best = Alarm(last, since, names[k], float(size[k]), float(strength[k]),
                             tuple(near), tuple(moved))  # fmt: skip
        assert best is not None  # the last flight alone at the least
        return best

    def _named(self, names: Sequence[str], strength: Array) -> int:
        """Return which cause is named first: a rare one only where no other is as near."""
        order = [int(j) for j in np.argsort(-strength)]
        near = strength[order[0]] ** 2 - _NEAR
        usual = (j for j in order if names[j] not in self.rare and strength[j] ** 2 > near)
        return next(usual, order[0])


@dataclass(frozen=True)
class _Flown:
    """Values of flights, (n, P), and the inverse of what each may be wrong by, (n, P, P)."""

    values: Array
    inverses: Array

    def mean(self, first: int, end: int) -> tuple[Array, Array]:
        """Return the weighted mean of some flights and its covariance."""
        inverses = self.inverses[first:end]
        covariance = np.linalg.inv(inverses.sum(axis=0))
        total = np.einsum("nij,nj->i", inverses, self.values[first:end])
        return covariance @ total, covariance
