"""Test of an input as a function of measured signals: gains, delay, lag and wash-out.

    u(t) = sum_k K_k * F(s) * x_k(t - delay) + constant,   F(s) = 1 / (1 + s lag) * s T / (1 + s T)

One filter and one delay are common to all signals, so that no derivative can be made of two of them
that would undo the aircraft. An aircraft answers its input later, a law answers the aircraft later:
a law must explain the input from what was, better than anything does from what is to come. In
closed loop only what such a law leaves over tells input and signals apart (Soderstrom & Stoica,
System Identification, 1989, ch. 10).

An autopilot has gyros of its own, or reads the logged ones at another time: the noise of measured
signals is then in no input. It hides a law and makes its gains small. Where its size is known it is
taken out of the products of the signals (Fuller, Measurement Error Models, 1987, sec. 2.2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.feedback_record import NO_FILTER, SHAPES, FeedbackRecord, Shape

FEWEST_ROWS = 40
STEP_S, LONGEST_S = 0.02, 0.4  # of the delays tried
RESPONSE_STEPS = 2  # steps: from here on a signal answers the input
WORTH = 0.7  # of what is left unexplained: a further signal must leave no more
FILTER_WORTH = 0.5  # the same of a filter
TOGETHER_WORTH = 0.25  # the same of several signals at once
ENOUGH_R2 = 0.99  # an input so well explained asks for no further signal or filter
MOST_SIGNALS = 4
HOPELESS = 0.4  # R2 of all signals at their best delay, without a filter
FEEDBACK_R2 = 0.9  # R2 from which an input is a function of the signals
BETTER = 0.6  # of what later signals leave unexplained: earlier ones must leave no more
RIDGE = 1e-10  # of a signal's power
MOST_NOISE = 0.5  # of any sum of signals, and of the input: a noisier one tells no law
NOISE_KNOWN = 0.1  # a law leaves this share of its noise at least: no better is it known
SHARED = 0.5  # of the noise: a law that explains more than there is by this has it in the input too
MORE = 0.5  # of what is explained, where R2 is as large as noise allows: the better delay
WORSE = 0.01  # in R2 than on the grid: no better delay or filter
FLAT = 0.8  # of the largest value: a lower neighbour is on no parabola with it


@dataclass(frozen=True, slots=True)
class FeedbackLaw:
    """Law that an input follows.

    Attributes
    ----------
    signals : tuple of str
        The strongest first.
    gains : tuple of float
        Of each, input over signal.
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


@dataclass(frozen=True, slots=True)
class _Found:
    """Signals by number, with their filter (lag, wash-out) and delay; is noise taken out?"""

    r2: float = 0.0
    signals: tuple[int, ...] = ()
    shape: Shape = NO_FILTER
    delay_s: float = 0.0
    cleaned: bool = False


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
    values, names = np.column_stack(list(signals.values())), tuple(signals)
    record = FeedbackRecord(dt_s, moved, values, windows, noise)
    before = _before(record)
    law = _law(record, before, names)
    if law is None and len(noise) and before.r2 >= FEEDBACK_R2:
        # All of the noise may be in the input too.
        record = FeedbackRecord(dt_s, moved, values, windows)
        law = _law(record, _before(record), names)
    return law


def _delays() -> Array:
    return STEP_S * np.arange(round(LONGEST_S / STEP_S) + 1)


def _before(record: FeedbackRecord) -> _Found:
    """Return what of earlier signals explains the input, nothing where that is hopeless."""
    if record.rows.size < FEWEST_ROWS or not float(record.target @ record.target) > 0.0:
        return _Found()
    everything = range(record.values.shape[1])
    if np.max(_r2(*record.products(NO_FILTER, _delays()), everything)) < HOPELESS:
        return _Found()
    return _simplest(record, dict.fromkeys(SHAPES, _delays()), FEEDBACK_R2)


def _law(record: FeedbackRecord, before: _Found, names: Sequence[str]) -> FeedbackLaw | None:
    """Return the law, if earlier signals explain enough, and better than later ones."""
    if before.r2 < FEEDBACK_R2:
        return None
    later = {shape: -shape[0] - _delays()[RESPONSE_STEPS:] for shape in SHAPES}
    after = _simplest(record, later)
    if 1.0 - before.r2 > BETTER * (1.0 - after.r2):
        return None
    return _refined(record, before, names)


class _Grid(NamedTuple):
    """Delays of each filter, products of the input and all signals behind them, and of noise.

    Those are of shape (filters, delays, 1 + signals, 1 + signals), noise has no last axis.
    """

    delays_s: Mapping[Shape, Array]
    products: Array
    noise: Array


def _simplest(
    record: FeedbackRecord, delays_s: Mapping[Shape, Array], least_r2: float = 0.0
) -> _Found:
    """Return as few signals and as simple a filter as explain the input.

    One signal after the other is added while it is worth it. A law of several may need them all at
    once (heading, bank and roll rate of an autopilot): where all together explain far more, those
    that are not worth it are left out one by one. Of every filter as many delays are tried.
    """
    products, noise = zip(*(record.products(*item) for item in delays_s.items()), strict=True)
    grid = _Grid(delays_s, np.stack(products), np.stack(noise))
    best = _Found()
    count = record.values.shape[1]
    if float(np.max(_r2(grid.products, grid.noise, range(count)))) < least_r2:
        return best
    while len(best.signals) < min(MOST_SIGNALS, count) and best.r2 < ENOUGH_R2:
        rest = [k for k in range(count) if k not in best.signals]
        tried = [_best(grid, (*best.signals, k)) for k in rest]
        found = max(tried, key=lambda f: f.r2)
        if 1.0 - found.r2 > WORTH * (1.0 - best.r2):
            break
        best = found
    fewer = _eliminated(grid, tuple(range(count)))
    return fewer if 1.0 - fewer.r2 < TOGETHER_WORTH * (1.0 - best.r2) else best


def _eliminated(grid: _Grid, columns: tuple[int, ...]) -> _Found:
    """Return what is left of some signals by backward elimination."""
    best = _best(grid, columns)
    while len(best.signals) > 1:
        left = (tuple(c for c in best.signals if c != k) for k in best.signals)
        found = max((_best(grid, some) for some in left), key=lambda f: f.r2)
        needed = found.r2 < ENOUGH_R2 and 1.0 - best.r2 < WORTH * (1.0 - found.r2)
        if len(best.signals) <= MOST_SIGNALS and needed:
            break
        best = found
    return best


def _best(grid: _Grid, columns: tuple[int, ...]) -> _Found:
    """Return filter and delay of some signals: no filter where none is worth it."""
    best = _Found()
    fits = _fits(grid.products, grid.noise, columns)
    for n, (shape, delays) in enumerate(grid.delays_s.items()):
        tried = []
        for cleaned, fit in enumerate(fits):
            k = int(np.argmax(fit.explained[n]))
            r2 = float(fit.r2[n, k]) + (_rise(fit.explained[n], k) if cleaned else 0.0)
            tried.append(_Found(min(r2, 1.0), columns, shape, float(delays[k]), bool(cleaned)))
        found = max(tried, key=lambda f: f.r2)
        worth = best.r2 < ENOUGH_R2 and 1.0 - found.r2 < FILTER_WORTH * (1.0 - best.r2)
        if not best.signals or worth:
            best = found
    return best


def _rise(values: Array, k: int) -> float:
    """Return by how much the parabola through the largest value and its neighbours rises more."""
    if not 0 < k < len(values) - 1:
        return 0.0
    before, top, after = (float(v) for v in values[k - 1 : k + 2])
    if min(before, after) < FLAT * top:
        return 0.0
    return (before - after) ** 2 / (8.0 * max(2.0 * top - before - after, 1e-300))


def _refined(record: FeedbackRecord, found: _Found, names: Sequence[str]) -> FeedbackLaw:
    """Return the law with delay and time constants between those of the grid."""
    from scipy import optimize  # where no input follows anything, nothing else loads it (0.25 s)

    record = record.of_signals(found.signals)
    lag_s, washout_s = found.shape
    lagged, washed = lag_s > 0.0, washout_s < np.inf
    shape = [np.log(x) for x, there in ((lag_s, lagged), (washout_s, washed)) if there]
    start = np.array([found.delay_s, *shape])

    def law(p: Array) -> tuple[float, float, float]:
        lag = float(np.exp(p[1])) if lagged else 0.0
        return max(float(p[0]), 0.0), lag, float(np.exp(p[-1])) if washed else np.inf

    def gram(p: Array) -> tuple[Array, Array]:
        delay, lag, wash = law(p)
        return record.products((lag, wash), np.array([delay]))

    def fit(p: Array) -> _Fit:
        return _fits(*gram(p), range(len(found.signals)))[int(found.cleaned)]

    def left(p: Array) -> float:
        [r2], [explained], _ = fit(p)
        return float(1.0 - r2 - MORE * explained)

    simplex = np.vstack([start, start + np.diag([STEP_S / 2.0, *[0.3] * len(shape)])])
    best = optimize.minimize(
        left,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-6, "maxfev": 80},
    )
    # Time constants that let the signals be mostly noise explain more than there is.
    x = start if fit(start).r2[0] > fit(best.x).r2[0] + WORSE else best.x
    [r2], _, [gains] = fit(x)
    order = np.argsort(-np.abs(gains) * np.sqrt(np.diag(gram(x)[0][0])[1:]))
    return FeedbackLaw(
        tuple(names[found.signals[k]] for k in order),
        tuple(float(gains[k]) for k in order),
        *law(x),
        float(r2),
    )


def _r2(products: Array, noise: Array, columns: Sequence[int]) -> Array:
    """Return R2 of the input by some signals, of each matrix of products, (...)."""
    return np.asarray(np.max([fit.r2 for fit in _fits(products, noise, columns)], axis=0))


class _Fit(NamedTuple):
    """Fit of each matrix of products: R2, share of power explained, gains (..., signals).

    What is explained may be more than there is, as noise is not known exactly. It tells the better
    delay; R2 is no better than noise is known.
    """

    r2: Array
    explained: Array
    gains: Array


def _fits(products: Array, noise: Array, columns: Sequence[int]) -> list[_Fit]:
    """Return the fit of the input by some signals as they are, and, if there is noise, without."""
    at = [1 + k for k in columns]
    scale = np.sqrt(np.maximum(np.diagonal(products, axis1=-2, axis2=-1), 1e-300))
    scaled = products / (scale[..., :, None] * scale[..., None, :])
    own, cross = scaled[..., at, :][..., at] + RIDGE * np.eye(len(at)), scaled[..., at, 0]
    unit = scale[..., :1] / scale[..., at]
    gains = np.linalg.solve(own, cross[..., None])[..., 0]
    r2 = np.sum(gains * cross, axis=-1)
    fits = [_Fit(r2, r2, gains * unit)]
    if noise.any():
        share = noise / scale**2
        r2, explained, gains = _cleaned(own, cross, (share[..., 0], share[..., at]), r2)
        fits.append(_Fit(r2, explained, gains * unit))
    return fits


def _cleaned(own: Array, cross: Array, noise: tuple[Array, Array], r2: Array) -> _Fit:
    """Return the fit without the shares of noise in input and signals, all of unit power.

    Where these, or what is left with them, are mostly noise nothing is explained. More may be
    explained than there is: noise that is in the input too was none.
    """
    moved, share = noise
    # No sum of signals has a larger part of noise than this.
    part = np.sum(share * np.diagonal(np.linalg.inv(own), axis1=-2, axis2=-1), axis=-1)
    usable = (part < MOST_NOISE) & (r2 > MOST_NOISE)
    clean = own - np.where(usable[..., None], share, 0.0)[..., None] * np.eye(own.shape[-1])
    gains = np.linalg.solve(clean, cross[..., None])[..., 0]
    explained = np.sum(gains * cross, axis=-1)
    random = np.sum(share * gains**2, axis=-1) + moved
    left = 1.0 - explained - moved
    left = np.maximum(np.maximum(left, -left - SHARED * random), NOISE_KNOWN * random)
    usable &= random < MOST_NOISE
    return _Fit(np.where(usable, 1.0 - left, 0.0), np.where(usable, explained, 0.0), gains)
