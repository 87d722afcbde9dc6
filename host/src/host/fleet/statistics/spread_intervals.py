"""Intervals of a type's mean and of its two spreads made for few aircraft.

Between flights: the profile of the restricted likelihood. That no variance is negative narrows it:
with three flights of each of eight equal aircraft an interval by the flights' squares alone is 1.24
times as wide as an oracle's by chi-squared; the profile is 1.04 times (`studies.fleet_truth`).

Between aircraft: all values that the weighted squares of the aircraft do not reject (Q profile:
Viechtbauer, Statistics in Medicine 26, 2007). The flights' spread stands in the denominator and is
itself estimated: F, its second degrees of freedom by Satterthwaite.

The mean: Student's, with the aircraft's own scatter about it (Hartung & Knapp, Statistics in
Medicine 20, 2001). Errors that aircraft share leave no trace in that scatter and are added.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, special

from host.constants import NORMAL_95
from host.fleet.statistics.variance_components import (
    FleetEstimates,
    Reduced,
    reduced,
    restricted_likelihood,
)

LOWER, UPPER = 0.025, 0.975
CHI_SQUARE_95 = NORMAL_95**2  # of one degree of freedom
_LEAST = 1e-9  # of the scatter: a variance above zero, where flights have no error of their own
_FINE = 1e-3  # of the scatter's deviation: to which an end is searched
_WIDEST = 1e8  # times the scatter: an upper end beyond it is not known
MANY = 1e9  # degrees of freedom: as good as infinitely many


@dataclass(frozen=True, slots=True)
class Interval:
    """A value and the ends of its two-sided 95 % interval; an unknown end is infinite or NaN."""

    value: float
    lower: float
    upper: float

    @property
    def width(self) -> float:
        """Upper less lower end."""
        return self.upper - self.lower

    def holds(self, truth: float) -> bool:
        """Return whether a value is inside."""
        return self.lower <= truth <= self.upper


@dataclass(frozen=True, slots=True)
class TypeEffect:
    """One derivative of a type.

    Attributes
    ----------
    mean, between, within : Interval
        Mean of the type; standard deviations between its aircraft and between flights of one.
    mean_deviation : float
        Standard deviation of the mean by aircraft and flights.
    shared_deviation : float
        Standard deviation of the mean by errors that several aircraft share.
    aircraft, flights : int
    differs : float
        Probability of so much scatter between aircraft if they were all alike.
    """

    mean: Interval
    between: Interval
    within: Interval
    mean_deviation: float
    shared_deviation: float
    aircraft: int
    flights: int
    differs: float

    @property
    def new_aircraft(self) -> Interval:
        """Prediction for the next aircraft of the type: the mean, with its 95 % interval."""
        half = _student(self.aircraft - 1) * math.hypot(self.mean_deviation, self.between.value)
        half = math.hypot(half, NORMAL_95 * self.shared_deviation)
        return Interval(self.mean.value, self.mean.value - half, self.mean.value + half)


@dataclass(frozen=True, slots=True)
class KnownSpreads:
    """Spreads known beforehand, as an oracle's for comparison; None: estimated."""

    between: float | None = None
    within: float | None = None


def type_effect(data: FleetEstimates, known: KnownSpreads | None = None) -> TypeEffect:
    """Return mean and spreads of one derivative with 95 % intervals.

    Parameters
    ----------
    data : FleetEstimates
        Estimates of two aircraft or more.
    known : KnownSpreads, optional
        Standard deviations not to be estimated; the intervals are then an oracle's.
    """
    known = known or KnownSpreads()
    between, within = restricted_likelihood(data)
    between = between if known.between is None else known.between**2
    within = within if known.within is None else known.within**2
    fit = reduced(data, between, within)
    lone = reduced(replace(data, shared=data.shared[:, :0]), between, within)
    shared = math.sqrt(max(1.0 / fit.information - 1.0 / lone.information, 0.0))
    own = 1.0 / lone.information
    if known.between is None:
        split = _between_form(data, between, within)
        own *= split / (data.fleet - 1)
        half = math.hypot(_student(data.fleet - 1) * math.sqrt(own), NORMAL_95 * shared)
    else:
        half = NORMAL_95 * math.hypot(math.sqrt(own), shared)
    return TypeEffect(
        mean=Interval(fit.mean, fit.mean - half, fit.mean + half),
        between=_between_interval(data, between, within, known),
        within=_within_interval(data, within, known),
        mean_deviation=math.sqrt(own),
        shared_deviation=shared,
        aircraft=data.fleet,
        flights=data.flights,
        differs=_probability_alike(data, within, known),
    )


def _between_form(data: FleetEstimates, between: float, within: float) -> float:
    """Return the weighted squares of the aircraft about the type, chi-squared of aircraft - 1."""
    whole: Reduced = reduced(data, between, within)
    return max(whole.quadratic - reduced(data, math.inf, within).quadratic, 0.0)


def _within_interval(data: FleetEstimates, within: float, known: KnownSpreads) -> Interval:
    """Return the standard deviation between flights, by profile of the restricted likelihood."""
    inside = data.flights - data.fleet
    if inside < 1:
        return Interval(math.nan, 0.0, math.inf)
    middle, scale = math.sqrt(within), math.sqrt(data.grain)
    limit = CHI_SQUARE_95 * (1.0 + 1.0 / inside)
    best = _profile(data, max(within, _LEAST * data.grain), known)

    def beyond(deviation: float) -> float:
        variance = max(deviation**2, _LEAST * data.grain)
        return _profile(data, variance, known) - best - limit

    lower = 0.0
    if beyond(0.0) > 0.0:
        lower = _root(beyond, 0.0, max(middle, _LEAST), scale)
    upper = max(middle, 0.1 * scale)
    while beyond(upper) < 0.0:
        upper *= 1.5
        if upper > _WIDEST * scale:
            return Interval(middle, lower, math.inf)
    return Interval(middle, lower, _root(beyond, middle, upper, scale))


def _profile(data: FleetEstimates, within: float, known: KnownSpreads) -> float:
    """Return the least deviance over the spread between aircraft."""
    if known.between is not None:
        return reduced(data, known.between**2, within).deviance
    high = 3.0 * math.sqrt(data.scatter)
    found = optimize.minimize_scalar(
        lambda x: reduced(data, x * x, within).deviance,
        bounds=(0.0, high),
        method="bounded",
        options={"xatol": 3e-3 * math.sqrt(data.grain)},
    )
    return min(float(found.fun), reduced(data, 0.0, within).deviance)


def _root(form: Callable[[float], float], low: float, high: float, scale: float) -> float:
    found = optimize.brentq(form, low, high, xtol=_FINE * scale)
    return float(np.asarray(found).item())


def _between_interval(
    data: FleetEstimates, between: float, within: float, known: KnownSpreads
) -> Interval:
    """Return the standard deviation between aircraft."""

    def surplus(tail: float) -> Callable[[float], float]:
        def form(variance: float) -> float:
            freedom = MANY if known.within is not None else _denominator(data, variance, within)
            limit = (data.fleet - 1) * float(special.fdtri(data.fleet - 1, freedom, 1.0 - tail))
            return _between_form(data, variance, within) / limit

        return form

    ends = [_where(surplus(p), 1.0, data.grain, 0.0) for p in (LOWER, UPPER)]
    if ends[1] == 0.0:
        ends[1] = _likely_upper(data, within)
    return Interval(math.sqrt(between), *(math.sqrt(e) for e in ends))


def _likely_upper(data: FleetEstimates, within: float) -> float:
    """Return the upper end where aircraft are more alike than chance makes them in 39 of 40 fleets:
    no variance has such squares, so the bound comes from the likelihood alone."""
    limit = reduced(data, 0.0, within).deviance + CHI_SQUARE_95
    return _where(lambda x: limit - reduced(data, x, within).deviance, 0.0, data.grain, 0.0)


def _probability_alike(data: FleetEstimates, within: float, known: KnownSpreads) -> float:
    freedom = MANY if known.within is not None else _denominator(data, 0.0, within)
    return float(
        special.fdtrc(data.fleet - 1, freedom, _between_form(data, 0.0, within) / (data.fleet - 1))
    )


def _denominator(data: FleetEstimates, between: float, within: float) -> float:
    """Return the degrees of freedom of the F test's denominator.

    The variance of an aircraft's mean is `between` and a part by flights; of the latter the spread
    between flights is estimated from (flights - aircraft) squares.
    """
    inside = data.flights - data.fleet
    if inside < 1:
        return MANY
    weight = 1.0 / np.maximum(data.variance + within, 1e-300)
    sum1, sum2 = (np.add.reduceat(w, data.first) for w in (weight, weight**2))
    of_mean, slope = 1.0 / sum1, sum2 / sum1**2
    information = 0.5 * float(np.sum(weight**2)) * inside / data.flights
    share = float(np.mean(slope / (between + of_mean)))
    return min(2.0 * information / max(share**2, 1e-300), MANY)


def _where(form: Callable[[float], float], limit: float, scale: float, floor: float) -> float:
    """Return the variance at which a falling form meets a limit; the floor if it begins below."""
    if form(floor) <= limit:
        return 0.0
    high = scale
    while form(high) > limit:
        high *= 4.0
        if high > _WIDEST * scale:
            return math.inf
    low = high / 4.0
    while low > 1e-12 * scale and form(low) <= limit:
        high, low = low, low / 4.0
    if form(low) <= limit:
        return max(low, floor)
    found = optimize.brentq(lambda x: form(math.exp(x)) - limit, math.log(low), math.log(high))
    return math.exp(float(np.asarray(found).item()))


def _student(freedom: int) -> float:
    return float(special.stdtrit(max(freedom, 1), UPPER))
