"""Whether an input is a function of measured signals: gains, delay, lag and wash-out of its law.

    u(t) = sum_k K_k * F(s) * x_k(t - delay) + constant,   F(s) = 1 / (1 + s lag) * s T / (1 + s T)

One filter and one delay are common to all signals, so that no derivative can be made of two of them
that would undo the aircraft. An aircraft answers its input later, a law answers the aircraft later:
a law must explain the input from what was, better than anything does from what is to come. In
closed loop only what such a law leaves over tells input and signals apart (Soderstrom & Stoica,
System Identification, 1989, ch. 10).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.first_order_filter import first_order_filter

MOST_ROWS = 500  # that are compared; more tell no more of a few numbers
FEWEST_ROWS = 40
STEP_S, LONGEST_S = 0.02, 0.4  # of the delays tried
RESPONSE_STEPS = 2  # steps: from here on a signal answers the input
LAGS_S = (0.0, 0.1, 0.3)  # shorter ones are a delay
WASHOUTS_S = (np.inf, 4.0, 2.0, 1.0, 0.5)
WORTH = 0.7  # of what is left unexplained: a further signal must leave no more
FILTER_WORTH = 0.5  # the same of a filter
TOGETHER_WORTH = 0.25  # the same of several signals at once
MOST_SIGNALS = 4
HOPELESS = 0.4  # R2 of all signals at their best delay, without a filter
FEEDBACK_R2 = 0.9  # R2 from which an input is a function of the signals
BETTER = 0.6  # of what later signals leave unexplained: earlier ones must leave no more
LEAST_DECAY = 1e-3  # of a filter's state at the start of a record
RIDGE = 1e-10  # of a signal's power
WHOLE = 1e-9  # of a sample: less is rounding
Shape = tuple[float, float]  # lag and wash-out, s
NO_FILTER: Shape = (0.0, np.inf)
SHAPES: tuple[Shape, ...] = tuple((lag, wash) for lag in LAGS_S for wash in WASHOUTS_S)


@dataclass(frozen=True, slots=True)
class FeedbackLaw:
    """What an input follows.

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
    """Signals by number, with their filter (lag, wash-out) and delay."""

    r2: float = 0.0
    signals: tuple[int, ...] = ()
    shape: Shape = NO_FILTER
    delay_s: float = 0.0


def feedback_law(
    dt_s: float, moved: Array, signals: Mapping[str, Array], windows: Sequence[IntArray]
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
    """
    if not signals:
        return None
    record = _Record(dt_s, moved, np.column_stack(list(signals.values())), windows)
    if record.rows.size < FEWEST_ROWS or not float(record.target @ record.target) > 0.0:
        return None
    steps = STEP_S * np.arange(round(LONGEST_S / STEP_S) + 1)
    everything = tuple(range(len(signals)))
    if np.max(_r2(record.products(NO_FILTER, steps), everything)) < HOPELESS:
        return None
    before = _simplest(record, dict.fromkeys(SHAPES, steps), FEEDBACK_R2)
    if before.r2 < FEEDBACK_R2:
        return None
    after = _simplest(record, {shape: -shape[0] - steps[RESPONSE_STEPS:] for shape in SHAPES})
    if 1.0 - before.r2 > BETTER * (1.0 - after.r2):
        return None
    return _refined(record, before, tuple(signals))


class _Grid(NamedTuple):
    """Delays of each filter, and products of the input and all signals behind them.

    Those are of shape (filters, delays, 1 + signals, 1 + signals).
    """

    delays_s: Mapping[Shape, Array]
    products: Array


class _Record:
    """The input and the signals in some windows, behind any filter and delay."""

    def __init__(
        self, dt_s: float, moved: Array, values: Array, windows: Sequence[IntArray]
    ) -> None:
        stride = max(1, -(-sum(len(w) for w in windows) // MOST_ROWS))
        kept = [np.asarray(w)[::stride] for w in windows if len(w)]
        self.dt_s = dt_s
        self.values = values - values[0]
        self._behind: dict[Shape, Array] = {}  # the signals, of single filters of the grid
        self.rows: IntArray = np.concatenate(kept) if kept else np.zeros(0, dtype=np.int64)
        self.sizes = np.array([len(w) for w in kept])
        self.target = self._centred(moved[self.rows][None, :, None])[0, :, 0]

    def _centred(self, values: Array) -> Array:
        """Return values (delays, rows, columns) without the mean of each window."""
        if not values.size:
            return values
        starts = np.concatenate([[0], np.cumsum(self.sizes)[:-1]])
        means = np.add.reduceat(values, starts, axis=1) / self.sizes[None, :, None]
        return np.asarray(values - np.repeat(means, self.sizes, axis=1))

    def products(self, shape: Shape, delays: Array) -> Array:
        """Return products of the input and all signals, (delays, 1 + signals, 1 + signals)."""
        values = self._of_grid(shape) if shape in SHAPES else self._filtered(shape)
        whole = np.floor(delays / self.dt_s + WHOLE).astype(np.int64)
        part = (delays / self.dt_s - whole)[:, None, None]
        at = self.rows[None, :] - whole[:, None]
        last = len(values) - 1
        late = values[np.clip(at, 0, last)]
        if np.max(np.abs(part)) > WHOLE:
            late = (1.0 - part) * late + part * values[np.clip(at - 1, 0, last)]
        target = np.broadcast_to(self.target[None, :, None], (*late.shape[:2], 1))
        both = np.concatenate([target, self._centred(late)], axis=2)
        for decay in self._free_decays(shape):
            both -= decay[:, None] * (decay @ both)[:, None, :]
        return np.asarray(both.transpose(0, 2, 1) @ both)

    def _filtered(self, shape: Shape) -> Array:
        values: Array = self.values
        for b, a in _sections(*shape, self.dt_s):
            values = first_order_filter(b, a, values)
        return values

    def _of_grid(self, shape: Shape) -> Array:
        """Return the same of a filter of the grid, of whose parts each is run once.

        In partial fractions a lag and a wash-out behind each other are b g / (1 - b - g) times the
        signal less what either makes of it; b and g are their first coefficients.
        """
        lag_s, washout_s = shape
        if lag_s > 0.0 and washout_s < np.inf:
            b, g = (numerator[0] for numerator, _ in _sections(*shape, self.dt_s))
            either = self._of_grid((lag_s, np.inf)) + self._of_grid((0.0, washout_s))
            return np.asarray((self.values - either) * (b * g / (1.0 - b - g)))
        if shape not in self._behind:
            self._behind[shape] = self._filtered(shape)
        return self._behind[shape]

    def _free_decays(self, shape: Shape) -> list[Array]:
        """Return an orthonormal basis of the responses to a filter's unknown initial state."""
        found: list[Array] = []
        for time_s in shape:
            if not 0.0 < time_s < np.inf:
                continue
            decay = np.exp(-self.rows * self.dt_s / time_s)
            decay = self._centred(decay[None, :, None])[0, :, 0]
            for other in found:
                decay = decay - other * (other @ decay)
            if (size := float(np.sqrt(decay @ decay))) > LEAST_DECAY:
                found.append(decay / size)
        return found


def _simplest(record: _Record, delays_s: Mapping[Shape, Array], least_r2: float = 0.0) -> _Found:
    """Return as few signals and as simple a filter as explain the input.

    One signal after the other is added while it is worth it. A law of several may need them all at
    once (heading, bank and roll rate of an autopilot): where all together explain far more, those
    that are not worth it are left out one by one. Of every filter as many delays are tried.
    """
    grid = _Grid(delays_s, np.stack([record.products(*item) for item in delays_s.items()]))
    best = _Found()
    count = record.values.shape[1]
    if float(np.max(_r2(grid.products, range(count)))) < least_r2:
        return best
    while len(best.signals) < min(MOST_SIGNALS, count):
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
        if len(best.signals) <= MOST_SIGNALS and 1.0 - best.r2 < WORTH * (1.0 - found.r2):
            break
        best = found
    return best


def _best(grid: _Grid, columns: tuple[int, ...]) -> _Found:
    """Return filter and delay of some signals: no filter where none is worth it."""
    best = _Found()
    every = _r2(grid.products, columns)
    for (shape, delays), r2 in zip(grid.delays_s.items(), every, strict=True):
        k = int(np.argmax(r2))
        if not best.signals or 1.0 - r2[k] < FILTER_WORTH * (1.0 - best.r2):
            best = _Found(float(r2[k]), columns, shape, float(delays[k]))
    return best


def _refined(record: _Record, found: _Found, names: Sequence[str]) -> FeedbackLaw:
    """Return the law with delay and time constants between those of the grid."""
    from scipy import optimize  # where no input follows anything, nothing else loads it (0.25 s)

    lag_s, washout_s = found.shape
    lagged, washed = lag_s > 0.0, washout_s < np.inf
    shape = [np.log(x) for x, there in ((lag_s, lagged), (washout_s, washed)) if there]
    start = np.array([found.delay_s, *shape])

    def law(p: Array) -> tuple[float, float, float]:
        lag = float(np.exp(p[1])) if lagged else 0.0
        return max(float(p[0]), 0.0), lag, float(np.exp(p[-1])) if washed else np.inf

    def gram(p: Array) -> Array:
        delay, lag, wash = law(p)
        return record.products((lag, wash), np.array([delay]))

    def left(p: Array) -> float:
        return float(1.0 - _r2(gram(p), found.signals)[0])

    simplex = np.vstack([start, start + np.diag([STEP_S / 2.0, *[0.3] * len(shape)])])
    best = optimize.minimize(
        left,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-6, "maxfev": 80},
    )
    at = [1 + k for k in found.signals]
    [g] = gram(best.x)
    gains = np.linalg.lstsq(g[np.ix_(at, at)], g[at, 0], rcond=None)[0]
    order = np.argsort(-np.abs(gains) * np.sqrt(np.diag(g)[at]))
    return FeedbackLaw(
        tuple(names[found.signals[k]] for k in order),
        tuple(float(gains[k]) for k in order),
        *law(best.x),
        1.0 - float(best.fun),
    )


def _r2(products: Array, columns: Sequence[int]) -> Array:
    """Return R2 of the input by some signals, of each matrix of products, (...)."""
    at = [1 + k for k in columns]
    own, cross = products[..., at, :][..., at], products[..., at, 0]
    scale = np.sqrt(np.maximum(np.diagonal(own, axis1=-2, axis2=-1), 1e-300))
    own = own / (scale[..., :, None] * scale[..., None, :]) + RIDGE * np.eye(len(at))
    cross = cross / scale
    solved = np.linalg.solve(own, cross[..., None])[..., 0]
    return np.asarray(np.sum(solved * cross, axis=-1) / np.maximum(products[..., 0, 0], 1e-300))


def _sections(lag_s: float, washout_s: float, dt_s: float) -> Iterator[tuple[Array, Array]]:
    """Yield numerator and denominator of each part of the filter (Tustin)."""
    for time_s, gains in ((lag_s, (dt_s, dt_s)), (washout_s, (2.0 * washout_s, -2.0 * washout_s))):
        if 0.0 < time_s < np.inf:
            size = 2.0 * time_s + dt_s
            yield np.array(gains) / size, np.array([1.0, (dt_s - 2.0 * time_s) / size])
