"""What is not known of an estimate: a covariance that every cause makes larger."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from host.arrays import Array, IntArray


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Covariance of an estimate, and what its intervals and its reader need beside it.

    Attributes
    ----------
    covariance : Array, shape (P, P)
    degrees_of_freedom : Array, shape (P,)
        Of the t distribution of each interval; infinite means normal.
    warnings : tuple of str
        One sentence for each reason to trust the estimate less.
    details : mapping
        Numbers for reports: name to value or array.
    """

    covariance: Array
    degrees_of_freedom: Array
    warnings: tuple[str, ...] = ()
    details: Mapping[str, float | Array] = field(default_factory=dict)

    @property
    def variance(self) -> Array:
        """Variance of each estimate, (P,)."""
        return np.diag(self.covariance)

    def plus(self, covariance: Array, *warnings: str) -> Uncertainty:
        """Return the same with a covariance added to that of the first parameters, (k, k)."""
        total, count = self.covariance.copy(), len(covariance)
        total[:count, :count] += covariance
        return replace(self, covariance=total, warnings=(*self.warnings, *warnings))

    def times(self, factor: Array) -> Uncertainty:
        """Return the same with deviations of the first parameters so many times larger, (k,)."""
        every = np.ones(len(self.covariance))
        every[: len(factor)] = factor
        return replace(self, covariance=self.covariance * np.outer(every, every))

    def of_a_sample(self, places: IntArray, freedom: Array | float, *warnings: str) -> Uncertainty:
        """Return the same with at most so many degrees of freedom at some places, at least one."""
        own = self.degrees_of_freedom.copy()
        own[places] = np.minimum(own[places], np.maximum(freedom, 1.0))
        return replace(self, degrees_of_freedom=own, warnings=(*self.warnings, *warnings))
