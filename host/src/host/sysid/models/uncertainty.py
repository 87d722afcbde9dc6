"""What is not known of an estimate: a covariance that every cause makes larger.

Repeated maneuvers that disagree, residuals that the inputs drive and effects of inputs that are
absent may show one error of a model. Each test speaks of the noise alone (`ModelError`), never of
what another made of it, so that nothing depends on which is heard first.

An error of mass, of a sensor's place, of a calibration or of a delay is the same in every sample,
and more data do not average it away. Such an error is a consider parameter: it is not estimated,
but its standard deviation, from `host.instrument` or the aircraft file, counts in the covariance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from host.arrays import Array, IntArray

DOMINANT_SHARE = 0.25  # of the variance: an error with less is not named


def consider_covariance(shifts: Array) -> Array:
    """Return the covariance that systematic errors add, sum over errors k of s_k s_k', (P, P).

    EQUATIONS.md, eq. 35.

    Parameters
    ----------
    shifts : Array, shape (errors, P)
        Shift s_k of the estimate for one standard deviation of each error.
    """
    return np.asarray(shifts.T @ shifts)


def dominant_error_source(parts: dict[str, float], variance: float) -> str:
    """Return the error that causes most of a variance; empty if none causes a quarter of it.

    Parameters
    ----------
    parts : dict
        Variance that each error causes.
    variance : float
        Total, in the same unit.
    """
    if not parts:
        return ""
    cause = max(parts, key=parts.__getitem__)
    return cause if parts[cause] >= DOMINANT_SHARE * max(variance, 1e-300) else ""


ALIKE = 1e6  # times larger: eigenvectors still have four digits


def covariance_root(covariance: Array) -> Array:
    """Return R with R R' = covariance, (P, P); it may be singular.

    Deviations of unlike size are first scaled to one. With two parameters that nothing
    separates, with deviations of 1e11, eigenvectors of the bare matrix are rounding for all others:
    noise that is estimated with them gets 30 times its variance, and intervals four to nine
    times their width.

    Parameters
    ----------
    covariance : Array, shape (P, P)
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = deviation[deviation > 0.0]
    unlike = len(known) > 0 and float(known.max()) > ALIKE * float(known.min())
    scale = np.where(unlike & (deviation > 0.0), deviation, 1.0)
    value, vector = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vector * np.sqrt(np.maximum(value, 0.0)), dtype=np.float64)


def _none() -> Array:
    return np.zeros(0)


@dataclass(frozen=True)
class ModelError:
    """Model error by one test, of the first parameters; an empty part says nothing.

    Attributes
    ----------
    factor : Array, shape (k,)
        By which each deviation is too small.
    least : Array, shape (k,)
        Variance that each has at least.
    shift : Array, shape (k,)
        By how much each estimate may be off, one deviation.
    variance : Array, shape (k,)
        What each adds to that of noise.
    freedom : Array, shape (k,)
        Most degrees of freedom; infinite where the test says nothing.
    warnings : tuple of str
    """

    factor: Array = field(default_factory=_none)
    least: Array = field(default_factory=_none)
    shift: Array = field(default_factory=_none)
    variance: Array = field(default_factory=_none)
    freedom: Array = field(default_factory=_none)
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Covariance of an estimate, and what its intervals and its reader need with it.

    Attributes
    ----------
    covariance : Array, shape (P, P)
    degrees_of_freedom : Array, shape (P,)
        Degrees of freedom of the t distribution of each interval; infinite means normal.
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

    def with_model_error(self, found: Sequence[ModelError | None]) -> Uncertainty:
        """Return the same with what the model lacks, this being noise.

        Deviations grow by the product of all factors, then to the largest variance that any test
        asks for at least. Shifts have directions of their own and are consider covariances;
        variances add up; degrees of freedom are the fewest. The numbers do not depend on the order
        of the tests.

        Parameters
        ----------
        found : sequence of ModelError or None
            None: a test that found nothing.
        """
        said = [one for one in found if one is not None]
        if not said:
            return self
        count = len(self.covariance)
        factor = np.prod([_wide(one.factor, count, 1.0) for one in said], axis=0)
        least = np.max([_wide(one.least, count, 0.0) for one in said], axis=0)
        own = np.where(self.variance > 0.0, self.variance, np.inf)  # what is certain stays so
        factor = np.maximum(factor, np.sqrt(least / own))
        shifts = np.stack([_wide(one.shift, count, 0.0) for one in said])
        variance = np.sum([_wide(one.variance, count, 0.0) for one in said], axis=0)
        freedom = np.min([_wide(one.freedom, count, np.inf) for one in said], axis=0)
        lines = (line for one in said for line in one.warnings)
        known = self.times(factor).plus(consider_covariance(shifts) + np.diag(variance), *lines)
        return known.of_a_sample(np.arange(count), freedom)


def _wide(values: Array, count: int, rest: float) -> Array:
    """Return values of the first parameters, and what the rest has, (count,)."""
    every = np.full(count, rest)
    every[: len(values)] = values
    return every
