"""Input and signals in some windows, behind any filter and delay of a feedback law."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.numerics.first_order_filter import first_order_filter

LONGEST_S = 0.4  # delay of a law; as far apart samples are independent
MOST_ROWS = 500  # that are compared; more tell no more of a few numbers
LAGS_S = (0.0, 0.1, 0.3)  # shorter ones are a delay
WASHOUTS_S = (np.inf, 4.0, 2.0, 1.0, 0.5)
LEAST_DECAY = 1e-3  # of a filter's state at the start of a record
WHOLE = 1e-9  # of a sample: less is rounding
IMPULSE_ROWS = 500  # of a filter's response, for its noise
# With noise, input and signals are smoothed: the law stays as it is, and between samples is as much
# noise as at them, which would make those delays the better ones.
BELL = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0
Shape = tuple[float, float]  # lag and wash-out, s
NO_FILTER: Shape = (0.0, np.inf)
SHAPES: tuple[Shape, ...] = tuple((lag, wash) for lag in LAGS_S for wash in WASHOUTS_S)


class FeedbackRecord:
    """The input and the signals in some windows, behind any filter and delay."""

    def __init__(
        self,
        dt_s: float,
        moved: Array,
        values: Array,
        windows: Sequence[IntArray],
        noise: Sequence[float] = (),
    ) -> None:
        if len(noise):
            windows = [np.asarray(w)[len(BELL) // 2 : -(len(BELL) // 2)] for w in windows]
            moved, *smoothed = (np.convolve(x, BELL, "same") for x in (moved, *values.T))
            values = np.column_stack(smoothed)
        stride = max(1, -(-sum(len(w) for w in windows) // MOST_ROWS))
        kept = [np.asarray(w)[::stride] for w in windows if len(w)]
        self.dt_s = dt_s
        self.independent = max(sum(map(len, windows)) * dt_s / LONGEST_S, 1.0)  # samples
        self.values = values - values[0]
        self._behind: dict[Shape, Array] = {}  # the signals, of single filters of the grid
        self.rows: IntArray = np.concatenate(kept) if kept else np.zeros(0, dtype=np.int64)
        self.sizes = np.array([len(w) for w in kept])
        self.target = self._centred(moved[self.rows][None, :, None])[0, :, 0]
        self.power = np.zeros(1 + values.shape[1])  # of white noise, before it is smoothed
        if len(noise):
            self.power = (self.rows.size - self.sizes.size) * np.square(noise)

    def of_signals(self, signals: Sequence[int]) -> FeedbackRecord:
        """Return the same with some of the signals alone."""
        fewer = copy(self)
        fewer.values, fewer._behind = self.values[:, list(signals)], {}
        fewer.power = self.power[[0, *(1 + k for k in signals)]]
        return fewer

    def _centred(self, values: Array) -> Array:
        """Return values (delays, rows, columns) without the mean of each window."""
        if not values.size:
            return values
        starts = np.concatenate([[0], np.cumsum(self.sizes)[:-1]])
        means = np.add.reduceat(values, starts, axis=1) / self.sizes[None, :, None]
        return np.asarray(values - np.repeat(means, self.sizes, axis=1))

    def products(self, shape: Shape, delays: Array) -> tuple[Array, Array]:
        """Return products of the input and all signals, (delays, 1 + signals, 1 + signals).

        With them what noise adds to the squares, (delays, 1 + signals).
        """
        values = self._of_grid(shape) if shape in SHAPES else self._filtered(shape, self.values)
        whole = np.floor(delays / self.dt_s + WHOLE).astype(np.int64)
        part = (delays / self.dt_s - whole)[:, None, None]
        noise = self.power * np.ones((len(delays), 1))
        if self.power.any():
            noise[:, 0] *= BELL @ BELL
            noise[:, 1:] *= self._noise_gain(shape, part[:, 0])
        at = self.rows[None, :] - whole[:, None]
        last = len(values) - 1
        late = values[np.clip(at, 0, last)]
        if np.max(np.abs(part)) > WHOLE:
            late = (1.0 - part) * late + part * values[np.clip(at - 1, 0, last)]
        target = np.broadcast_to(self.target[None, :, None], (*late.shape[:2], 1))
        both = np.concatenate([target, self._centred(late)], axis=2)
        for decay in self._free_decays(shape):
            both -= decay[:, None] * (decay @ both)[:, None, :]
        return np.asarray(both.transpose(0, 2, 1) @ both), noise

    def _noise_gain(self, shape: Shape, part: Array) -> Array:
        """Return the power of white noise, smoothed, behind a filter, (delays, 1)."""
        impulse = np.zeros(IMPULSE_ROWS)
        impulse[1 : 1 + len(BELL)] = BELL
        response = self._filtered(shape, impulse)
        between = (1.0 - part) * response[1:] + part * response[:-1]
        return np.asarray(np.sum(between**2, axis=1, keepdims=True))

    def _filtered(self, shape: Shape, values: Array) -> Array:
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
            self._behind[shape] = self._filtered(shape, self.values)
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


def _sections(lag_s: float, washout_s: float, dt_s: float) -> Iterator[tuple[Array, Array]]:
    """Yield numerator and denominator of each part of the filter (Tustin)."""
    for time_s, gains in ((lag_s, (dt_s, dt_s)), (washout_s, (2.0 * washout_s, -2.0 * washout_s))):
        if 0.0 < time_s < np.inf:
            size = 2.0 * time_s + dt_s
            yield np.array(gains) / size, np.array([1.0, (dt_s - 2.0 * time_s) / size])
