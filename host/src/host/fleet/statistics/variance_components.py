"""Restricted likelihood of one derivative over the flights of a fleet.

    y = mu + a(aircraft) + f(flight) + e(estimate) + sum_k l_k b_k

a and f are the aircraft's and the flight's departures from the type, of unknown variances. e is the
flight's own error of estimation, of known variance. b_k are standardised errors that flights share,
such as that of one calibration: l_k is by how much one standard deviation moves each estimate.
Searle, Casella & McCulloch, Variance Components, ch. 6.

Everything is made of sums over the flights of each aircraft, so that time goes with the number of
flights and nothing is as large as flights by flights.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize

from host.arrays import Array, IntArray

FEWEST_AIRCRAFT = 2  # with one, its departure from the type cannot be estimated
MAD_TO_DEVIATION = 1.4826  # of a normal distribution
_START_SHARE = 0.02  # of the scatter: the search begins at no smaller variance
_WILD = 10.0  # ratio of scatter to that of most values, above which moments are a bad start
_ZERO_SHARE = 1e-7  # of the scatter: a variance below it is zero


@dataclass(frozen=True)
class FleetEstimates:
    """One derivative as every flight has it.

    Attributes
    ----------
    value : Array, shape (flights,)
        Sorted by aircraft.
    variance : Array, shape (flights,)
        Variance of the flight's own error of estimation, without any shared one.
    aircraft : IntArray, shape (flights,)
        From 0, rising.
    local : Array, shape (flights, r)
        Loadings of errors that flights of one aircraft share; a column may stand for another error
        in each aircraft.
    shared : Array, shape (flights, s)
        Loadings of errors that several aircraft share.
    """

    value: Array
    variance: Array
    aircraft: IntArray
    local: Array
    shared: Array

    @cached_property
    def first(self) -> IntArray:
        """Index of the first flight of each aircraft, (aircraft,)."""
        return np.flatnonzero(np.diff(self.aircraft, prepend=-1)).astype(np.int64)

    @property
    def flights(self) -> int:
        """Number of flights."""
        return len(self.value)

    @property
    def fleet(self) -> int:
        """Number of aircraft."""
        return len(self.first)

    @cached_property
    def scatter(self) -> float:
        """Variance of all values, the limit of the search for a spread."""
        return float(np.var(self.value)) or 1.0

    @cached_property
    def grain(self) -> float:
        """Variance of most values, the scale of the search: a single flight with a wild value and
        a large deviation must not coarsen it.
        """
        off = np.abs(self.value - np.median(self.value))
        return min(float(MAD_TO_DEVIATION * np.median(off)) ** 2, self.scatter) or self.scatter

    @cached_property
    def products(self) -> Array:
        """Products of the columns [1, local, shared, value] of each flight, (flights, m, m)."""
        ones = np.ones(self.flights)
        centred = self.value - np.mean(self.value)
        columns = np.column_stack([ones, self.local, self.shared, centred])
        return np.asarray(columns[:, :, None] * columns[:, None, :])

    def sums(self, weight: Array) -> Array:
        """Return those products weighted and summed over each aircraft, (aircraft, m, m)."""
        return np.asarray(
            np.add.reduceat(weight[:, None, None] * self.products, self.first, axis=0)
        )


@dataclass(frozen=True, slots=True)
class Reduced:
    """The generalised least-squares problem after elimination of the random effects.

    Attributes
    ----------
    information : float
        Information of the mean, 1 / its variance; 0 where each aircraft has a mean of its own.
    mean : float
        Generalised least squares.
    quadratic : float
        y'Py, the weighted squares of what the mean leaves.
    log_determinant : float
        Logarithm of the determinant of the covariance of all values.
    """

    information: float
    mean: float
    quadratic: float
    log_determinant: float

    @property
    def deviance(self) -> float:
        """-2 log of the restricted likelihood, but for a constant."""
        return self.log_determinant + float(np.log(self.information)) + self.quadratic


def reduced(data: FleetEstimates, between: float, within: float) -> Reduced:
    """Return mean, its information and the quadratic form for two variances.

    Parameters
    ----------
    data : FleetEstimates
    between : float
        Variance between aircraft; infinite: each aircraft has a mean of its own.
    within : float
        Variance between flights of an aircraft.
    """
    total = data.variance + within
    sums, own = data.sums(1.0 / total), data.local.shape[1]
    log_determinant = float(np.sum(np.log(total)))
    first = 0 if between > 0.0 else 1
    block, rest = slice(first, 1 + own), [0, *range(1 + own, sums.shape[1])]
    prior = np.ones(1 + own - first)
    if between > 0.0:
        prior[0] = 1.0 / between
        log_determinant += data.fleet * float(np.log(between)) if np.isfinite(between) else 0.0
    left = sums[:, rest][:, :, rest]
    if len(prior):
        inner = sums[:, block, block] + np.diag(prior)
        across = sums[:, block][:, :, rest]
        left = left - np.swapaxes(across, 1, 2) @ np.linalg.solve(inner, across)
        log_determinant += float(np.sum(np.linalg.slogdet(inner)[1]))
    whole = left.sum(axis=0)
    count = data.shared.shape[1]
    if count:
        common = slice(1, 1 + count)
        inner = whole[common, common] + np.eye(count)
        log_determinant += float(np.linalg.slogdet(inner)[1])
        ends = [0, -1]
        across = whole[common][:, ends]
        whole = whole[np.ix_(ends, ends)] - across.T @ np.linalg.solve(inner, across)
    information, moment, square = whole[0, 0], whole[0, -1], whole[-1, -1]
    if not np.isfinite(between):
        return Reduced(0.0, float("nan"), float(square), log_determinant)
    mean = moment / information
    return Reduced(
        float(information),
        float(mean + np.mean(data.value)),
        float(square - moment * mean),
        log_determinant,
    )


def restricted_likelihood(data: FleetEstimates) -> tuple[float, float]:
    """Return the variances between aircraft and between flights, by restricted likelihood.

    Parameters
    ----------
    data : FleetEstimates
        Estimates of two aircraft or more.
    """
    scale = data.grain
    floor = 0.0 if float(np.min(data.variance)) > 0.0 else _ZERO_SHARE
    # With one flight per aircraft the two variances cannot be separated; all is the aircraft's.
    limits = [(0.0, None), (floor, floor if data.flights == data.fleet else None)]

    def deviance(x: Array) -> float:
        return reduced(data, scale * max(x[0], 0.0), scale * max(x[1], floor)).deviance

    starts = [_moments(data) / scale]
    if data.scatter > _WILD * scale:
        starts.append(np.ones(2))
    found = [
        optimize.minimize(deviance, np.maximum(x, (0.0, floor)), method="L-BFGS-B", bounds=limits)
        for x in starts
    ]
    best = min(found, key=lambda one: float(one.fun))
    between, within = (float(scale * x) if x > _ZERO_SHARE else 0.0 for x in best.x)
    return between, within


def _moments(data: FleetEstimates) -> Array:
    """Return both variances by the squares about the aircraft's means, at least a little each."""
    count = np.diff(np.append(data.first, data.flights))
    mean = np.add.reduceat(data.value, data.first) / count
    inside = np.sum((data.value - mean[data.aircraft]) ** 2) / max(data.flights - data.fleet, 1)
    own = float(np.mean(data.variance))
    between = float(np.var(mean, ddof=1)) - inside / float(np.mean(count))
    least = _START_SHARE * data.scatter
    return np.array([max(between, least), max(float(inside) - own, least)])
