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
# Of 6000 flights of unchanged aircraft 0.32 in a hundred began an alarm (`studies.fleet_changes`).
THRESHOLD = 3.6
_NEAR = 4.0  # of the square: a cause as near to the best is not ruled out


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
    """

    flight: int
    since: int
    cause: str
    size: float
    strength: float
    others: tuple[str, ...] = ()


@dataclass(frozen=True)
class ChangeTest:
    """The test of one aircraft.

    Attributes
    ----------
    patterns : dict of str to (P,) Array
        By how much a cause of size 1 moves each derivative.
    spread : Array, shape (P,)
        Standard deviation between flights of an unchanged aircraft, from the whole type.
    """

    patterns: Mapping[str, Array]
    spread: Array

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
        found = []
        for last in range(BASELINE, len(values)):
            best = self.strongest(values[: last + 1], own[: last + 1])
            if best is not None and best.strength > threshold:
                found.append(best)
        return found

    def strongest(self, values: Sequence[Array], own: Sequence[Array]) -> Alarm | None:
        """Return the likeliest change that ends with the last flight; None without a baseline."""
        last = len(values) - 1
        if last < BASELINE:
            return None
        full = [c + np.diag(self.spread**2) for c in own]
        base, base_covariance = _mean(values[:BASELINE], full[:BASELINE])
        names = list(self.patterns)
        shapes = np.stack([self.patterns[name] for name in names], axis=1)
        best: Alarm | None = None
        for since in range(max(BASELINE, last - WINDOW + 1), last + 1):
            now, covariance = _mean(values[since:], full[since:])
            weighed = np.linalg.solve(covariance + base_covariance, shapes)
            information = np.einsum("pc,pc->c", shapes, weighed)
            size = (now - base) @ weighed / information
            strength = np.abs(size) * np.sqrt(information)
            k = int(np.argmax(strength))
            if best is None or float(strength[k]) > best.strength:
                near = [names[j] for j in np.argsort(-strength) if j != k and strength[j] ** 2
                        > strength[k] ** 2 - _NEAR]  # fmt: skip
                best = Alarm(last, since, names[k], float(size[k]), float(strength[k]), tuple(near))
        return best


def _mean(values: Sequence[Array], covariances: Sequence[Array]) -> tuple[Array, Array]:
    """Return the weighted mean of some flights and its covariance."""
    inverses = [np.linalg.inv(c) for c in covariances]
    covariance = np.linalg.inv(np.sum(inverses, axis=0))
    total = np.sum([w @ v for w, v in zip(inverses, values, strict=True)], axis=0)
    return covariance @ total, covariance
