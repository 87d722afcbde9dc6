"""Estimates of a flight that is received: when to ask, and what the state says of the answers.

Asked again as soon as the process has rested five times as long as it worked: it takes a fifth of a
core at most, however long the flight and however many rows a second.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from host.aircraft.file import load_measured
from host.live.estimates.estimate_worker import Answered, EstimateWorker
from host.planning.wanted_widths import wanted_widths

if TYPE_CHECKING:
    from host.planning.next_point import NextPoint

_LEAST_S = 1.0  # between two estimates
_REST = 5.0  # times what the last one took: a load of a sixth
_LEAST_BYTES = 20_000  # ten seconds of the radio: before, no test point is complete


def live_estimates(
    aircraft: str, wanted: str | None, recording: Path | None, calibration: str
) -> LiveEstimates:
    """Return estimates of a flight of this aircraft.

    Parameters
    ----------
    aircraft : str
        Name or file.
    wanted : str or None
        Half-widths, as `wanted_widths` takes them.
    recording : Path or None
        File that the session writes; without it (a replay) the bytes are kept in one of our own.
    calibration : str
        TOML, counts to SI; empty: that of the recording's head, else the default one.

    Raises
    ------
    HostError
        In one line: no such aircraft, wrong widths.
    """
    percent = wanted_widths(wanted)
    load_measured(aircraft)  # a misspelt name is refused now, not in flight
    own = tempfile.TemporaryDirectory(prefix="host-live-")
    place = Path(own.name)
    if calibration:
        (place / "calibration.toml").write_text(calibration, encoding="utf-8")
    worker = EstimateWorker(aircraft, place / "calibration.toml" if calibration else None, percent)
    worker.start()
    return LiveEstimates(worker, percent, recording, own)


class Worker(Protocol):
    """Who estimates, somewhere else."""

    busy: bool

    def ask(self, recording: Path) -> None:
        """Ask for an estimate from all that is in a file now."""
        ...

    def answer(self) -> Answered | None:
        """Return an answer if there is one."""
        ...

    def close(self) -> None:
        """End."""
        ...


class LiveEstimates:
    """Keeps the newest estimates of every wanted derivative.

    Parameters
    ----------
    worker : Worker
    wanted : mapping of str to float
        Half-width that is enough, per cent of the value.
    recording : Path or None
        File that the session writes.
    own : TemporaryDirectory
        Where the bytes are kept where there is no such file; removed by `close`.
    clock : callable
    """

    def __init__(
        self,
        worker: Worker,
        wanted: Mapping[str, float],
        recording: Path | None,
        own: tempfile.TemporaryDirectory[str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._worker = worker
        self._wanted = dict(wanted)
        self._clock = clock
        self._own = own
        self._kept = recording is None
        self._recording = recording or Path(own.name) / "replay.radio"
        self._size = self._asked_size = 0
        self._asked_s = -_LEAST_S
        self._due_s = 0.0
        self._began_s: float | None = None
        self._used_s = 0.0
        self._values: dict[str, tuple[float, float]] = {}
        self._last: Answered | None = None

    def take(self, data: bytes) -> None:
        """Take bytes of the stream, after they were written and decoded."""
        self._size += len(data)
        if self._kept:
            with self._recording.open("ab") as file:
                file.write(data)

    def tick(self) -> None:
        """Take an answer, and ask again when it is time; never waits."""
        now_s = self._clock()
        answered = self._worker.answer()
        if answered is not None:
            self._took(answered, now_s)
        if self._size < _LEAST_BYTES:
            self._asked_size = self._size
        fresh = self._size > self._asked_size
        if fresh and not self._worker.busy and now_s >= self._due_s:
            self._asked_size, self._asked_s = self._size, now_s
            if self._began_s is None:
                self._began_s = now_s
            self._worker.ask(self._recording)

    @property
    def idle(self) -> bool:
        """True once all that came is in the newest estimates."""
        return not self._worker.busy and self._asked_size == self._size

    def as_json(self) -> dict[str, Any]:
        """Return the newest estimates against what is wanted, for page and JSON lines."""
        last = self._last
        rows = [self._row(name, percent) for name, percent in self._wanted.items()]
        elapsed_s = self._clock() - self._began_s if self._began_s is not None else 0.0
        return {
            "rows": rows,
            "enough": sum(row["enough"] for row in rows),
            "until_s": round(last.until_s, 2) if last else None,
            "points": list(last.points) if last else [],
            "under_way": last.under_way if last else "",
            "why_not": last.why_not if last else "",
            "next": _next(last.next_point) if last else None,
            "load_percent": round(100.0 * self._used_s / elapsed_s, 1) if elapsed_s > 1.0 else None,
        }

    def value(self, name: str) -> tuple[float, float] | None:
        """Return the newest estimate and half-width of a derivative, None before there is one."""
        return self._values.get(name)

    def close(self) -> None:
        """End the process, and forget a replay's bytes."""
        self._worker.close()
        self._own.cleanup()

    def _took(self, answered: Answered, now_s: float) -> None:
        self._used_s += answered.used_s
        rest_s = _REST * max(answered.used_s, 0.0)
        self._due_s = max(now_s + rest_s, self._asked_s + _LEAST_S)
        if answered.values:
            self._values = answered.values
        if answered.until_s > 0.0 or self._last is None:
            self._last = answered

    def _row(self, name: str, percent: float) -> dict[str, Any]:
        """Return one derivative; `enough` holds while a later estimate keeps it."""
        value, half = self._values.get(name, (None, None))
        reached = abs(100.0 * half / value) if value and half is not None else None
        return {
            "name": name,
            "value": value,
            "half_width": half,
            "percent": round(reached, 2) if reached is not None else None,
            "wanted_percent": percent,
            "enough": reached is not None and reached <= percent,
        }


def _next(point: NextPoint | None) -> dict[str, Any] | None:
    """Return what to fly next: words, for which derivatives, how much is left by and by."""
    if point is None:
        return None
    from host.planning.next_point import in_words

    return {
        "text": in_words(point.segment),
        "for": list(point.wanting),
        "points": point.points,
        "seconds": round(point.seconds),
    }
