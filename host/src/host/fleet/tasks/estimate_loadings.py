"""An answer's covariance in two parts: the flight's own, and a loading of each named error.

A loading is the shift of all estimates by one standard deviation of an error. Flights of one
calibration or aircraft file share its errors, so their mean does not reduce these as it reduces
the flights' own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.instrument.error_sources import error_owner
from host.instrument.instrument_errors import InstrumentErrors
from host.sysid.coefficients import CoefficientFit

_SMALL_SHARE = 1e-4  # of every variance: a loading below it counts as the flight's own


@dataclass(frozen=True, slots=True)
class LoadedEstimates:
    """Estimates of a flight with their covariance in parts.

    Attributes
    ----------
    names : tuple of str
    values : Array, shape (P,)
    own : Array, shape (P, P)
        Covariance that no other flight shares.
    errors, sources : tuple of str, length E
        Names of shared errors, and what they belong to (`host.instrument.error_sources`).
    loadings : Array, shape (E, P)
    """

    names: tuple[str, ...]
    values: Array
    own: Array
    errors: tuple[str, ...]
    sources: tuple[str, ...]
    loadings: Array

    @property
    def total(self) -> Array:
        """The covariance of this flight alone, (P, P)."""
        return np.asarray(self.own + self.loadings.T @ self.loadings)


def coefficient_loadings(fit: CoefficientFit, errors: InstrumentErrors) -> LoadedEstimates:
    """Return the parts of a direct fit of coefficients.

    The fit estimates the errors too, so its covariance contains the noise of those estimates.
    Common to all flights is only the effect of each error's prior (`CoefficientFit`).

    Parameters
    ----------
    fit : CoefficientFit
        Fit of one flight.
    errors : InstrumentErrors
    """
    count = len(fit.derivatives)
    return split_covariance(
        tuple(d.name for d in fit.derivatives),
        np.array([d.value for d in fit.derivatives]),
        fit.covariance[:count, :count],
        fit.error_shifts,
        errors,
    )


def split_covariance(
    names: tuple[str, ...],
    values: Array,
    total: Array,
    shifts: dict[str, Array],
    errors: InstrumentErrors,
) -> LoadedEstimates:
    """Return a total covariance, (P, P), in its parts.

    Parameters
    ----------
    names, values
        Names and values of the estimates.
    total : Array, shape (P, P)
    shifts : dict of str to (P,) Array
        By one standard deviation of each error.
    errors : InstrumentErrors
    """
    variances = np.maximum(np.diag(total), 1e-300)
    kept = [
        (name, source, shift)
        for name, shift in shifts.items()
        if (source := error_owner(name, errors)) != "flight"
        and bool(np.any(shift**2 > _SMALL_SHARE * variances))
    ]
    loadings = np.array([shift for _, _, shift in kept]).reshape(-1, len(names))
    return LoadedEstimates(
        names,
        values,
        _positive(total - loadings.T @ loadings),
        tuple(name for name, _, _ in kept),
        tuple(source for _, source, _ in kept),
        loadings,
    )


def _positive(matrix: Array) -> Array:
    """Return the nearest covariance: rounding leaves small negative variances."""
    size, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors * np.maximum(size, 0.0)) @ vectors.T)
