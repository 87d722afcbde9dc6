"""One flight's estimates of the derivatives, and the errors that it shares with other flights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from host.arrays import Array
from host.fleet.statistics.variance_components import FleetEstimates

LOCAL_RANK = 3  # patterns kept of one aircraft's shared errors; the rest counts as the flight's
_LEFT_SHARE = 1e-3  # of the variance of shared errors that may count as the flights' own
_MOST_PATTERNS = 40

Source = tuple[str, str]  # whose error, and its name


@dataclass(frozen=True)
class LoadedFlight:
    """One flight of a fleet.

    Attributes
    ----------
    aircraft : str
    names : tuple of str
        Derivatives.
    values : Array, shape (P,)
    own : Array, shape (P, P)
        Covariance that no other flight shares.
    sources : tuple of (str, str), length E
        Owner and name of each shared error. All flights with the same source have the same error.
    loadings : Array, shape (E, P)
        Shift of all values by one standard deviation of each.
    left_out : frozenset of str
        Derivatives that a finding about the data speaks against.
    date, label : str
        When it was flown, and what it is called in a picture.
    conditions : dict
        Conditions of the flight and its aircraft file.
    watched : dict of str to (float, float)
        Value and standard deviation of quantities that are no derivatives (`watched_quantities`).
    """

    aircraft: str
    names: tuple[str, ...]
    values: Array
    own: Array
    sources: tuple[Source, ...]
    loadings: Array
    left_out: frozenset[str] = frozenset()
    date: str = ""
    label: str = ""
    conditions: dict[str, float] = field(default_factory=dict)
    watched: dict[str, tuple[float, float]] = field(default_factory=dict)

    def has_estimate(self, name: str) -> bool:
        """Return whether the flight has an estimate of a derivative that counts."""
        return name in self.names and name not in self.left_out

    def total_variance(self, name: str) -> float:
        """Return the variance of one estimate with every error."""
        k = self.names.index(name)
        return float(self.own[k, k] + self.loadings[:, k] @ self.loadings[:, k])


def fleet_estimates(flights: Sequence[LoadedFlight], name: str) -> FleetEstimates:
    """Return the estimates of one derivative from all flights that count.

    An error whose source only one aircraft has is local to that aircraft; others are shared by
    aircraft. A shared error shifts all its flights by the mean of their loadings, and the
    difference to a flight's own loading counts as the flight's own error. Otherwise a low
    estimate, whose loading is small with it, would get too much weight and bias the mean low
    (Peelle's puzzle: D'Agostini, Nuclear Instruments and Methods A 346, 1994).
    """
    own_flights = sorted((f for f in flights if f.has_estimate(name)), key=lambda f: f.aircraft)
    at = [f.names.index(name) for f in own_flights]
    codes = np.unique([f.aircraft for f in own_flights], return_inverse=True)[1].astype(np.int64)
    value = np.array([f.values[k] for f, k in zip(own_flights, at, strict=True)])
    variance = np.array([f.own[k, k] for f, k in zip(own_flights, at, strict=True)])
    owners: dict[str, set[int]] = {}
    for flight, code in zip(own_flights, codes.tolist(), strict=True):
        for whose, _ in flight.sources:
            owners.setdefault(whose, set()).add(code)
    common = {whose for whose, aircraft in owners.items() if len(aircraft) > 1}
    rows = [
        {source: float(x) for source, x in zip(f.sources, f.loadings[:, k], strict=True)}
        for f, k in zip(own_flights, at, strict=True)
    ]
    local, rest = np.zeros((len(own_flights), LOCAL_RANK)), np.zeros(len(own_flights))
    for code in range(int(codes[-1]) + 1 if len(codes) else 0):
        inside = np.flatnonzero(codes == code)
        matrix, uneven = _matrix([rows[i] for i in inside], lambda s: s[0] not in common)
        local[inside], left = _patterns(matrix, LOCAL_RANK)
        rest[inside] = left + uneven
    matrix, uneven = _matrix(rows, lambda s: s[0] in common)
    shared, left = _patterns(matrix, _enough(matrix))
    return FleetEstimates(value, variance + rest + left + uneven, codes, local, shared)


def _matrix(
    rows: Sequence[dict[Source, float]], wanted: Callable[[Source], bool]
) -> tuple[Array, Array]:
    """Return loadings of the flights by source, (flights, sources), the mean of each in all flights
    that have it, and the variance of each flight by which its own differ."""
    names = list(dict.fromkeys(s for row in rows for s in row if wanted(s)))
    shape = len(rows), len(names)
    found = np.array([[row.get(s, 0.0) for s in names] for row in rows]).reshape(shape)
    has = np.array([[s in row for s in names] for row in rows]).reshape(shape)
    mean = has * (found.sum(axis=0) / np.maximum(has.sum(axis=0), 1))
    return mean, np.sum((found - mean) ** 2, axis=1)


def _patterns(matrix: Array, rank: int) -> tuple[Array, Array]:
    """Return the main patterns, (flights, rank), and the variance that they leave of each."""
    found = np.zeros((len(matrix), rank))
    if matrix.size and rank:
        left, size, _ = np.linalg.svd(matrix, full_matrices=False)
        kept = min(rank, len(size))
        found[:, :kept] = left[:, :kept] * size[:kept]
    total = np.sum(matrix**2, axis=1) if matrix.size else np.zeros(len(matrix))
    return found, np.maximum(total - np.sum(found**2, axis=1), 0.0)


def _enough(matrix: Array) -> int:
    """Return how many patterns leave little of the shared variance."""
    if not matrix.size:
        return 0
    size = np.linalg.svd(matrix, compute_uv=False) ** 2
    left = 1.0 - np.cumsum(size) / max(float(np.sum(size)), 1e-300)
    return min(1 + int(np.count_nonzero(left > _LEFT_SHARE)), len(size), _MOST_PATTERNS)
