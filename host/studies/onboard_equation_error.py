"""Equation error of one moment coefficient from running transforms, as the logger solves it.

Line by line the arithmetic of `firmware/core/learning/equation_error.cpp`: in single precision bit
for bit, in double precision what it is judged by.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from host.planning.onboard_sums import (
    PITCH,
    SAMPLE_HZ,
    YAW,
    AxisCard,
    FourierSums,
)
from numpy.typing import NDArray

PRODUCTS_AT_ONCE = 5
LEAST_LEFT = 1e-5
RADPS = 0.61359232  # 2 pi 50 / 512
STUDENT = (
    12706, 4303, 3182, 2776, 2571, 2447, 2365, 2306, 2262,
    2228, 2201, 2179, 2160, 2145, 2131, 2120, 2110, 2101,
)  # fmt: skip
Floats = NDArray[Any]  # of the one precision or the other


@dataclass(frozen=True, slots=True)
class Learned:
    """Answer of one solve.

    Attributes
    ----------
    estimate, half_width : (signals,) arrays
        Values of the coefficient's derivatives; a half-width of 0: not estimated.
    enough : tuple of bool
        The half-width is at most the wanted share of the estimate.
    """

    estimate: Floats
    half_width: Floats
    enough: tuple[bool, ...]


@dataclass(slots=True)
class _Row:
    """One harmonic: regressors and left side, real and imaginary parts apart."""

    columns: Floats
    moment: Floats


class EquationError:
    """Solves in slices, between which samples may be taken.

    Parameters
    ----------
    card : AxisCard
    sums : FourierSums
    double : bool
        In double precision.
    """

    def __init__(self, card: AxisCard, sums: FourierSums, *, double: bool = False) -> None:
        self._card, self._sums = card, sums
        self._real: Any = np.float64 if double else np.float32
        self._radps = self._real(2.0 * np.pi * SAMPLE_HZ / 512.0 if double else RADPS)
        self.learned: Learned | None = None

    def slices(self) -> Iterator[bool]:
        """Yield once a slice whether it was the last; `learned` is set there."""
        with np.errstate(all="ignore"):
            for _ in self._solve():
                yield False
        yield True

    def _solve(self) -> Iterator[None]:
        count = self._card.signals
        matrix = np.zeros((count + 1, count + 1), dtype=self._real)
        for harmonic in range(len(self._card.harmonics)):
            row = self._row(harmonic)
            every = np.vstack([row.columns, row.moment])
            yield from _nothing(1 + self._card.signals)
            matrix += _outer(every[:, 0]) + _outer(every[:, 1])
            yield from _nothing(-(-(count + 1) * (count + 2) // 2 // PRODUCTS_AT_ONCE))
        dropped = yield from _swept(matrix, count)
        wanted = [s for s in range(count) if self._card.wanted_percent[s] > 0]
        spread = np.zeros(count, dtype=self._real)
        residual = self._real(0.0)
        for harmonic in range(len(self._card.harmonics)):
            row = self._row(harmonic)
            for c in range(count):
                row.moment += -matrix[c, count] * row.columns[c]
            square = _squared(row.moment)
            residual += square
            for s in wanted:
                moved = np.zeros(2, dtype=self._real)
                for c in range(count):
                    moved += -matrix[s, c] * row.columns[c]
                spread[s] += square * _squared(moved)
            last = harmonic == len(self._card.harmonics) - 1
            yield from _nothing(self._card.signals + 2 + len(wanted) - last)
        self._finish(matrix, spread, residual, dropped)

    def _row(self, harmonic: int) -> _Row:
        """Return one harmonic's regressors and moment at this instant."""
        card, sums, real = self._card, self._sums, self._real
        radps = self._radps * real(card.harmonics[harmonic])
        share = sums.share(harmonic)
        x = (sums.sums[harmonic] - sums.halved(share)).astype(real)
        end = (share * SAMPLE_HZ).astype(real)
        across = radps * x[:, ::-1]
        rate = np.stack([end[:, 0] - across[:, 0], end[:, 1] + across[:, 1]], axis=1)
        row = _Row(x.copy(), np.zeros(2, dtype=real))
        rates = (1,) if card.axis == PITCH else (1, 2)
        own = 2 if card.axis == YAW else 1
        for s in range(card.signals):
            if s in rates:
                row.moment += (real(1.0) if s == own else -real(card.product)) * rate[s]
                continue
            a = 0 if s == 0 else s - len(rates)
            curvature = real(card.curvature_s2[a]) * radps
            row.columns[s] += real(card.advance_s[a]) * rate[s]
            row.columns[s] += curvature * np.array([-rate[s, 1], rate[s, 0]], dtype=real)
        row.columns[0] += real(card.lever) * x[rates[-1]]
        return row

    def _finish(self, matrix: Floats, spread: Floats, residual: Any, dropped: set[int]) -> None:
        card, real = self._card, self._real
        count, lines = card.signals, len(card.harmonics)
        freedom = 2 * lines - (count - len(dropped))
        estimate, half_width = (np.zeros(card.signals, dtype=real) for _ in range(2))
        enough = [False] * card.signals
        for s in range(card.signals):
            if s in dropped or freedom <= 0 or not card.wanted_percent[s]:
                continue
            student = real(STUDENT[min(freedom, len(STUDENT)) - 1]) * real(0.001)
            mean = residual * -matrix[s, s]
            own = real(lines) * spread[s]
            variance = max(mean, own) / real(freedom)
            scale = real(card.gain[s]) * student
            random = scale * scale * variance
            known = real(card.tolerance[s]) * real(card.tolerance[s])
            estimate[s] = real(card.gain[s]) * matrix[s, count]
            half_width[s] = np.sqrt(random + known)
            wanted = real(card.wanted_percent[s]) * real(0.01) * estimate[s]
            enough[s] = bool(half_width[s] <= abs(wanted))
        self.learned = Learned(estimate, half_width, tuple(enough))


def _swept(matrix: Floats, count: int) -> Generator[None, None, set[int]]:
    """Sweep every pivot in place and return those that were dropped.

    After all the matrix is minus its inverse, its last column the solution (Goodnight, The American
    Statistician 33, 1979).
    """
    real = matrix.dtype.type
    whole = matrix.diagonal().copy()
    dropped: set[int] = set()
    for k in range(count):
        yield
        if not matrix[k, k] > real(LEAST_LEFT) * whole[k]:
            dropped.add(k)
            matrix[k] = matrix[:, k] = 0.0
            yield
            continue
        others = [c for c in range(count + 1) if c != k]
        column = matrix[:, k].copy()
        for row in others:
            factor = column[row] / column[k]
            for c in others:
                if c >= row:
                    matrix[row, c] -= factor * column[c]
                    matrix[c, row] = matrix[row, c]
        yield from _nothing(count + 1)
        inverse = real(1.0) / column[k]
        matrix[k] = matrix[:, k] = column * inverse
        matrix[k, k] = -inverse
        yield
    return dropped


def _outer(values: Floats) -> Floats:
    return values[:, None] * values[None, :]


def _squared(z: Floats) -> Any:
    return z[0] * z[0] + z[1] * z[1]


def _nothing(slices: int) -> Iterator[None]:
    for _ in range(slices):
        yield
