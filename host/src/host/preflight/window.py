"""Means and scatter of the last seconds."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence


class Window:
    """Rows of some columns over a span; NaN anywhere in a row empties it.

    Parameters
    ----------
    span_s : float
    """

    def __init__(self, span_s: float) -> None:
        self.span_s = span_s
        self._rows: deque[tuple[float, tuple[float, ...]]] = deque()

    def add(self, t_s: float, row: Sequence[float]) -> None:
        """Take a row."""
        if not all(map(math.isfinite, row)):
            self._rows.clear()
            return
        self._rows.append((t_s, tuple(row)))
        while self._rows[0][0] < t_s - self.span_s:
            self._rows.popleft()

    def clear(self) -> None:
        """Forget all rows."""
        self._rows.clear()

    @property
    def full(self) -> bool:
        """Whether its rows span at least nine tenths of its time."""
        return len(self._rows) > 2 and self._rows[-1][0] - self._rows[0][0] > 0.9 * self.span_s

    def columns(self) -> list[list[float]]:
        """Return the columns."""
        return [list(column) for column in zip(*(row for _, row in self._rows), strict=True)]


def mean(column: Sequence[float]) -> float:
    """Return the mean."""
    return sum(column) / len(column)


def scatter(column: Sequence[float]) -> float:
    """Return the standard deviation."""
    middle = mean(column)
    return math.sqrt(sum((one - middle) ** 2 for one in column) / len(column))
