"""How well the radio works: rows a second, lost in percent, age of the last one."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

_WINDOW_S = 10.0
_SILENT_S = 1.0


@dataclass(frozen=True, slots=True)
class LinkState:
    """The link over the last ten seconds.

    Parameters
    ----------
    rows_per_s, bytes_per_s : float
    lost_percent : float
        Share of the rows that should have come.
    age_s : float
        Since anything could be decoded; infinite before the first frame.
    """

    rows_per_s: float
    bytes_per_s: float
    lost_percent: float
    age_s: float

    @property
    def silent(self) -> bool:
        """True when what is shown is old."""
        return self.age_s > _SILENT_S


class LinkBudget:
    """Counts over a window of ten seconds."""

    def __init__(self) -> None:
        self._portions: deque[tuple[float, int, int, int]] = deque()
        self._first_s: float | None = None
        self._heard_s: float | None = None

    def add(self, now_s: float, size_bytes: int, rows: int, lost: int, received: bool) -> None:
        """Count a portion; `received` if anything in it could be decoded."""
        self._first_s = now_s if self._first_s is None else self._first_s
        self._portions.append((now_s, size_bytes, rows, lost))
        if received:
            self._heard_s = now_s

    def at(self, now_s: float) -> LinkState:
        """Return the state at an instant of `time.monotonic`."""
        while self._portions and self._portions[0][0] < now_s - _WINDOW_S:
            self._portions.popleft()
        span_s = min(_WINDOW_S, max(1.0, now_s - (self._first_s or now_s)))
        rows = sum(part[2] for part in self._portions)
        lost = sum(part[3] for part in self._portions)
        return LinkState(
            rows_per_s=rows / span_s,
            bytes_per_s=sum(part[1] for part in self._portions) / span_s,
            lost_percent=100.0 * lost / (rows + lost) if rows + lost else 0.0,
            age_s=float("inf") if self._heard_s is None else now_s - self._heard_s,
        )
