"""Test whether an aircraft has changed since its own first flights, and name the likely cause.

A cause moves several derivatives in a pattern of its own. For each cause, and each of the last few
flights as the first of the change, its size is estimated by generalised least squares; that over
its standard deviation is the statistic (generalised likelihood ratio: Basseville & Nikiforov,
Detection of Abrupt Changes, ch. 2). The largest is compared with the threshold. Errors that all
flights of an aircraft share are in its first flights too, so they cancel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import special

from host.arrays import Array

BASELINE = 8  # first flights, with which later ones are compared
WINDOW = 4  # flights over which a change is looked for
# An alarm begins in 0.4 of a hundred flights of unchanged aircraft (`studies.fleet_changes`).
THRESHOLD = 3.75
_NEAR = 4.0  # a cause whose squared statistic is at most so much below the best is named too
_MOVED = 2.0  # standard deviations
SELDOM = 0.025  # probability that honest covariances give so large a mean square

Mean = tuple[Array, Array]  # (P,) and its covariance


@dataclass(frozen=True, slots=True)
class Alarm:
    """A change found at one flight, and its likely cause.

    Attributes
    ----------
    flight : int
        Its number among the aircraft's flights, from 0.
    since : int
        The first flight of the change, as it seems.
    cause : str
        The likeliest.
    size : float
        Size of the change, in the unit of its pattern.
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
    scales : dict of str to float
        Ratio of a cause's real scatter to that by the covariances; 1 without it (`scaled`).
    """

    patterns: Mapping[str, Array]
    spread: Array
    rare: frozenset[str] = frozenset()
    scales: Mapping[str, float] = field(default_factory=dict)

    def scaled(self, first: Sequence[tuple[Sequence[Array], Sequence[Array]]]) -> ChangeTest:
        """Return the test with the scatter of each cause in unchanged flights of the type.

        Each of an aircraft's first flights is compared with the rest of them. Where a cause's size
        scatters by more than the covariances allow, that scatter counts, so that intervals which
        are too narrow raise no alarm.

        Parameters
        ----------
        first : sequence of (values, own)
            First flights of each aircraft, as in `alarms`.
        """
        squares: dict[str, list[float]] = {name: [] for name in self.patterns}
        freedom = 0
        for values, own in first:
            if len(values) < 2:
                continue
            flown = self._flown(values, own)
            freedom += len(values) - 1
            for k in range(len(values)):
                others = [j for j in range(len(values)) if j != k]
                strength = np.abs(self._sizes(flown.mean([k]), flown.mean(others))[1])
                for name, z in zip(self.patterns, strength.tolist(), strict=True):
                    squares[name].append(z**2)
        if not freedom:
            return self
        usual = float(special.chdtri(freedom, SELDOM)) / freedom
        found = {name: float(np.mean(z)) for name, z in squares.items()}
        return replace(self, scales={n: float(np.sqrt(x)) for n, x in found.items() if x > usual})

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
        flown = self._flown(values, own)
        base = flown.mean(range(BASELINE))
        found = (self._strongest(flown, base, last) for last in range(BASELINE, len(values)))
        return [alarm for alarm in found if alarm.strength > threshold]

    def _strongest(self, flown: _Flown, base: tuple[Array, Array], last: int) -> Alarm:
        """Return the likeliest change that ends with a flight."""
        names = list(self.patterns)
        best: Alarm | None = None
        for since in range(max(BASELINE, last - WINDOW + 1), last + 1):
            now = flown.mean(range(since, last + 1))
            size, signed = self._sizes(now, base)
            strength = np.abs(signed)
            k = self._named(names, strength)
            if best is None or float(strength[k]) > best.strength:
                near = [names[j] for j in np.argsort(-strength) if j != k and strength[j] ** 2
                        > strength[k] ** 2 - _NEAR]  # fmt: skip
                off = np.abs(now[0] - base[0]) / np.sqrt(np.diag(now[1] + base[1]))
                moved = [int(j) for j in np.argsort(-off) if off[j] > _MOVED]
                best = Alarm(last, since, names[k], float(size[k]), float(strength[k]),
                             tuple(near), tuple(moved))  # fmt: skip
        assert best is not None  # the last flight alone at the least
        return best

    def _flown(self, values: Sequence[Array], own: Sequence[Array]) -> _Flown:
        return _Flown(np.stack(values), np.linalg.inv(np.stack(own) + np.diag(self.spread**2)))

    def _sizes(self, now: Mean, before: Mean) -> tuple[Array, Array]:
        """Return the size of each cause's change between two means, and that over its deviation."""
        shapes = np.stack(list(self.patterns.values()), axis=1)
        weighed = np.linalg.solve(now[1] + before[1], shapes)
        information = np.einsum("pc,pc->c", shapes, weighed)
        size = (now[0] - before[0]) @ weighed / information
        scale = np.array([self.scales.get(name, 1.0) for name in self.patterns])
        return size, size * np.sqrt(information) / scale

    def _named(self, names: Sequence[str], strength: Array) -> int:
        """Return which cause is named first: a rare one only where no other is as near."""
        order = [int(j) for j in np.argsort(-strength)]
        near = strength[order[0]] ** 2 - _NEAR
        usual = (j for j in order if names[j] not in self.rare and strength[j] ** 2 > near)
        return next(usual, order[0])


@dataclass(frozen=True)
class _Flown:
    """Values of flights, (n, P), and the inverse of their covariances, (n, P, P)."""

    values: Array
    inverses: Array

    def mean(self, flights: Sequence[int]) -> Mean:
        """Return the weighted mean of some flights and its covariance."""
        at = list(flights)
        covariance = np.linalg.inv(self.inverses[at].sum(axis=0))
        total = np.einsum("nij,nj->i", self.inverses[at], self.values[at])
        return covariance @ total, covariance
