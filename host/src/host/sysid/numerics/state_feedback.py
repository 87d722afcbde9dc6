"""Test of an input as a function of measured signals: gains, delay, lag and wash-out.

    u(t) = sum_k K_k * F(s) * x_k(t - delay) + constant,   F(s) = 1 / (1 + s lag) * s T / (1 + s T)

One filter and one delay are common to all signals, so that no derivative can be made of two of them
that would undo the aircraft. One criterion takes the best of all sets of signals and filters
(Schwarz, Annals of Statistics 6, 1978).

An aircraft answers its input later, a law answers the aircraft later: a law must explain the input
from what was, better than anything does from what is to come. In closed loop only what such a law
leaves over tells input and signals apart (Soderstrom & Stoica, System Identification, 1989, ch.
10).

An autopilot has gyros of its own, or reads the logged ones at another time: the noise of measured
signals is then in no input. It hides a law and makes its gains small. Where its size is known it is
taken out of the products of the signals (Fuller, Measurement Error Models, 1987, sec. 2.2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from host.arrays import Array, IntArray
from host.constants import TRUST_SHARE
from host.sysid.numerics.feedback_record import LONGEST_S, NO_FILTER, SHAPES, FeedbackRecord, Shape

STEP_S = 0.02
DELAYS_S = STEP_S * np.arange(round(LONGEST_S / STEP_S) + 1)  # that are tried
RESPONSE_STEPS = 2  # steps: from here on a signal answers the input
# Share of the input's variance: what a law leaves gives the derivatives beside it ten times the
# variance.
MOST_LEFT = 0.1
# A part of the input whose amplitude is within what an estimate is trusted by is as good as none.
LEAST_LEFT = TRUST_SHARE**2
RIDGE = 1e-10  # of a signal's power
END = 0.01  # of a step, and of a time constant: a search ends


@dataclass(frozen=True, slots=True)
class FeedbackLaw:
    """Law that an input follows.

    Attributes
    ----------
    signals : tuple of str
        The strongest first.
    gains : tuple of float
        Gain of each signal, input over signal.
    delay_s, lag_s : float
    washout_s : float
        Time constant; infinite without.
    r2 : float
        Share of the input's variance that it explains.
    """

    signals: tuple[str, ...]
    gains: tuple[float, ...]
    delay_s: float
    lag_s: float
    washout_s: float
    r2: float


class _Found(NamedTuple):
    """Signals by number with delay, lag and wash-out; the share of the input that they leave."""

    signals: tuple[int, ...] = ()
    delay_s: float = 0.0
    shape: Shape = NO_FILTER
    cleaned: bool = False  # is noise taken out?
    left: float = 1.0
    exact: bool = False  # is that as little as noise lets know?
    gains: Array = np.zeros(0)

    def cost(self, independent: float) -> float:
        """Return Schwarz's criterion by the number of independent samples."""
        filters = (self.shape[0] > 0.0) + (self.shape[1] < np.inf)
        size = len(self.signals) + filters
        return float(independent * np.log(max(self.left, LEAST_LEFT)) + size * np.log(independent))


def feedback_law(
    dt_s: float,
    moved: Array,
    signals: Mapping[str, Array],
    windows: Sequence[IntArray],
    noise: Sequence[float] = (),
) -> FeedbackLaw | None:
    """Return the law that an input follows in some windows; None if it follows none.

    Parameters
    ----------
    dt_s : float
        Sample period, s.
    moved : (n,) Array
        The input.
    signals : mapping of (n,) Array
        What it may follow.
    windows : sequence of IntArray
        Samples of each window; each has a constant of its own.
    noise : sequence of float
        Deviation of the white noise of the input and of each signal; none where it is empty.
    """
    if not signals:
        return None
    record = FeedbackRecord(dt_s, moved, np.column_stack(list(signals.values())), windows, noise)
    if not float(record.target @ record.target) > 0.0:
        return None
    before = _law(record)
    if before.left > MOST_LEFT:
        return None
    # The criterion's price of one more number.
    gained = record.independent * np.log(_after(record) / before.left)
    if gained < np.log(record.independent):
        return None
    names, sizes = tuple(signals), np.std(record.values[record.rows], axis=0)
    order = np.argsort(-np.abs(before.gains) * sizes[list(before.signals)])
    return FeedbackLaw(
        tuple(names[before.signals[k]] for k in order),
        tuple(float(before.gains[k]) for k in order),
        before.delay_s,
        *before.shape,
        1.0 - before.left,
    )


def _after(record: FeedbackRecord) -> float:
    """Return how little of the input all signals leave from what is to come."""
    later = {shape: -shape[0] - DELAYS_S[RESPONSE_STEPS:] for shape in SHAPES}
    return min(f.left for f in _tried(record, _grid(record, later), record.values.shape[1]))


def _law(record: FeedbackRecord) -> _Found:
    """Return the signals, the filter and the delay of least criterion; none where all leave much.

    All sets of as many signals are tried: one after the other, a signal that is like several
    together would stand for them (heading, bank and roll rate of an autopilot). More signals are
    tried while fewer leave something.
    """
    grid, signals = _grid(record, dict.fromkeys(SHAPES, DELAYS_S)), record.values.shape[1]
    best = _Found()
    if min(f.left for f in _tried(record, grid, signals)) > MOST_LEFT:
        return best
    for size in range(1, signals + 1):
        tried = _tried(record, grid, size)
        found = _refined(record, min(tried, key=lambda f: f.cost(record.independent)))
        if not found.cost(record.independent) < best.cost(record.independent):
            break
        best = found
        if best.exact:
            break
    return best


class _Products(NamedTuple):
    """Products of the input and all signals behind a filter, of each delay, and of noise."""

    shape: Shape
    delays_s: Array
    products: Array
    noise: Array


def _grid(record: FeedbackRecord, delays_s: Mapping[Shape, Array]) -> list[_Products]:
    return [_Products(*item, *record.products(*item)) for item in delays_s.items()]


def _tried(record: FeedbackRecord, grid: Sequence[_Products], size: int) -> list[_Found]:
    """Return the best delay of each set of so many signals, with each filter, noise in or out."""
    found = []
    for columns in combinations(range(record.values.shape[1]), size):
        for shape, delays_s, products, noise in grid:
            for cleaned, fit in enumerate(_fits(products, noise, columns)):
                k = int(np.argmax(fit.explained))
                law = _Found(columns, float(delays_s[k]), shape, bool(cleaned))
                found.append(_judged(record, law, fit, k))
    return found


def _refined(record: FeedbackRecord, found: _Found) -> _Found:
    """Return the same with delay and time constants between those of the grid."""
    from scipy import optimize  # where no input follows anything, nothing else loads it (0.25 s)

    fewer = record.of_signals(found.signals)
    columns = tuple(range(len(found.signals)))
    there = np.array([0.0 < time_s < np.inf for time_s in found.shape])
    start = np.array([found.delay_s / STEP_S, *np.log(np.array(found.shape)[there])])

    def at(p: Array) -> tuple[float, Shape, _Fit]:
        shape = np.array(found.shape)
        shape[there] = np.exp(p[1:])
        delay_s = float(np.clip(STEP_S * p[0], 0.0, LONGEST_S))
        lag_s, washout_s = (float(v) for v in shape)
        products = fewer.products((lag_s, washout_s), np.array([delay_s]))
        return delay_s, (lag_s, washout_s), _fits(*products, columns)[int(found.cleaned)]

    simplex = np.vstack([start, start + 0.5 * np.eye(len(start))])

    def unexplained(p: Array) -> float:
        return -float(at(p)[2].explained[0])

    best = optimize.minimize(
        unexplained,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": END},
    )
    delay_s, shape, fit = at(best.x)
    return _judged(record, found._replace(delay_s=delay_s, shape=shape), fit, 0)


def _judged(record: FeedbackRecord, found: _Found, fit: _Fit, k: int) -> _Found:
    """Return the same with what one fit leaves and its gains.

    White noise is known no better than independent samples tell its variance.
    """
    known = float(np.sqrt(2.0 / record.independent) * fit.random[k])
    left = max(float(fit.left[k]), known)
    return found._replace(left=left, exact=left <= max(known, LEAST_LEFT), gains=fit.gains[k])


class _Fit(NamedTuple):
    """Fit of each matrix of products: shares of power left, explained and of noise, gains.

    Without noise more may be explained than there is, as noise is not known exactly or is in the
    input too. The most explained tells the better delay all the same.
    """

    left: Array
    explained: Array
    gains: Array
    random: Array


def _fits(products: Array, noise: Array, columns: Sequence[int]) -> list[_Fit]:
    """Return the fit of the input by some signals as they are, and, if there is noise, without."""
    at = [1 + k for k in columns]
    scale = np.sqrt(np.maximum(np.diagonal(products, axis1=-2, axis2=-1), 1e-300))
    scaled = products / (scale[..., :, None] * scale[..., None, :])
    own, cross = scaled[..., at, :][..., at] + RIDGE * np.eye(len(at)), scaled[..., at, 0]
    unit = scale[..., :1] / scale[..., at]
    gains = np.linalg.solve(own, cross[..., None])[..., 0]
    explained = np.sum(gains * cross, axis=-1)
    fits = [_Fit(1.0 - explained, explained, gains * unit, np.zeros_like(explained))]
    if noise.any():
        share = noise / scale**2
        fit = _cleaned(own, cross, share[..., 0], share[..., at])
        fits.append(fit._replace(gains=fit.gains * unit))
    return fits


def _cleaned(own: Array, cross: Array, moved: Array, share: Array) -> _Fit:
    """Return the fit without the shares of noise in input and signals, all of unit power.

    Where these, or what is left with them, are mostly noise nothing is explained. What is explained
    beyond all there is counts as left: noise that is in the input too was none.
    """
    # No sum of signals has a larger part of noise than this.
    part = np.sum(share * np.diagonal(np.linalg.inv(own), axis1=-2, axis2=-1), axis=-1)
    usable = part < 1.0
    clean = own - np.where(usable[..., None], share, 0.0)[..., None] * np.eye(own.shape[-1])
    gains = np.linalg.solve(clean, cross[..., None])[..., 0]
    explained = np.sum(gains * cross, axis=-1)
    random = np.sum(share * gains**2, axis=-1) + moved
    left = np.abs(1.0 - explained - moved)
    return _Fit(np.where(usable, left, 1.0), np.where(usable, explained, 0.0), gains, random)
