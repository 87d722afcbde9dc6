"""What the logger itself estimates while it flies a row of its card: frames `learned`.

A consumer of the stream and a listener of the session. Each derivative has the ground's own
figure, where an aircraft is known.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from host.live.live_sample import LiveUpdate, SlowFrame
from host.live.live_stream import LiveStream
from host.live.slow_readings import slow_reading

AXES = {"Cm": "pitch", "Cl": "roll", "Cn": "yaw"}
SAMPLE_HZ = 50.0  # of the logger's sums (protocol/frames.toml, `learned`)
_SOLVED_S = 0.3  # of the stream, behind the last derivative of a solve: it is printed
_CARD_EVENTS = ("card_enabled", "input_start")


class LoggerLearning:
    """Keeps the newest estimate of each derivative, and tells each solve in a line.

    Parameters
    ----------
    stream : LiveStream
        Subscribed to.
    tell : callable
        Takes a line for the terminal, once a solve: a second of a row.
    clock : callable

    Attributes
    ----------
    ground : callable
        The ground's own estimate and half-width of a derivative, None where there is none.
    show : callable
        Takes each estimate as it comes: a row of `as_json`.
    """

    def __init__(
        self,
        stream: LiveStream,
        tell: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._stream = stream
        self.ground: Callable[[str], tuple[float, float] | None] = lambda name: None
        self.show: Callable[[dict[str, Any]], None] = lambda row: None
        self._tell = tell
        self._clock = clock
        self._card = False  # whether the logger has one, as far as the stream said
        self._rows: dict[str, dict[str, Any]] = {}
        self._solved: list[dict[str, Any]] = []  # of the solve that is arriving
        self._solve_us = 0  # when it began
        self._now_s = self._row_s = 0.0  # of the last row, and of it when a derivative came
        self._heard_s: float | None = None
        stream.subscribe(self._hear)

    def take(self, data: bytes) -> None:
        """Not the bytes: the stream's consumer takes what is made of them."""

    def tick(self) -> None:
        """Nothing to do: a solve is printed by the stream's own time."""

    def as_json(self) -> dict[str, Any]:
        """Return the newest estimates.

        Returns
        -------
        dict
            ``card``: whether the stream named a flight card; ``age_s`` since the last estimate,
            None before one; ``rows``: of each derivative ``name``, ``axis``, ``row`` of the card
            (from 1), ``after_s`` since its trigger, ``t_s``, ``value`` and ``half_width`` (None:
            not estimated), ``percent`` of the value, ``enough``, and the ``ground`` figure: value
            and half-width, or None.
        """
        return {
            "card": self._card,
            "age_s": None if self._heard_s is None else round(self._clock() - self._heard_s, 1),
            "rows": [self._compared(row) for row in self._rows.values()],
        }

    def close(self) -> None:
        """Tell what was heard of a last solve."""
        self._end_solve()

    def _compared(self, row: dict[str, Any]) -> dict[str, Any]:
        ground = self.ground(row["name"])
        figure = None if ground is None else {"value": ground[0], "half_width": ground[1]}
        return row | {"ground": figure}

    def _hear(self, update: LiveUpdate) -> None:
        if len(update):
            self._now_s = float(update.rows["t_s"][-1])
        for frame in update.slow:
            if frame.name in ("card", "input_config"):
                self._card = True
            elif frame.name == "event":
                self._card = self._card or self._word("event", frame, "code") in _CARD_EVENTS
            elif frame.name == "learned":
                self._learned(frame)
        if not 0.0 <= self._now_s - self._row_s <= _SOLVED_S:
            self._end_solve()

    def _word(self, table: str, frame: SlowFrame, field: str) -> str:
        schema = self._stream.schema
        return schema.word(table, int(frame.row[field])) if schema is not None else ""

    def _learned(self, frame: SlowFrame) -> None:
        if self._stream.schema is None:
            return
        said = slow_reading(self._stream.schema, frame)
        word = self._word("derivative", frame, "derivative")
        name = word[:1].upper() + word[1:]  # cm_alpha: Cm_alpha, as everywhere else
        value, half = float(said["estimate"]), said["half_width"]
        percent = round(abs(100.0 * half / value), 2) if value and half is not None else None
        row = {
            "name": name,
            "axis": AXES.get(name[:2], ""),
            "row": int(said["row"]) + 1,
            "after_s": int(said["samples"]) / SAMPLE_HZ,
            "t_s": round(frame.t_s, 3),
            "value": value,
            "half_width": half,
            "percent": percent,
            "enough": bool(said["enough"]),
        }
        began_us = int(frame.row["t_us"])
        if self._solve_us != began_us:
            self._end_solve()
        self._solve_us, self._row_s = began_us, self._now_s
        self._card, self._heard_s = True, self._clock()
        self._solved.append(row)
        self._rows[name] = row
        self.show(self._compared(row))

    def _end_solve(self) -> None:
        """Tell a solve in one line."""
        solved, self._solved = self._solved, []
        if not solved:
            return
        parts = [_in_words(self._compared(row)) for row in solved]
        first = solved[0]
        self._tell(f"the logger, row {first['row']}, {first['after_s']:.1f} s: {', '.join(parts)}")


def _in_words(row: dict[str, Any]) -> str:
    """Return one derivative as the terminal shows it."""
    if row["half_width"] is None:
        return f"{row['name']} not estimated"
    said = f"{row['name']} {row['value']:.4g} +- {row['half_width']:.2g}"
    ground = row["ground"]
    if ground is not None:
        said += f" (here {ground['value']:.4g} +- {ground['half_width']:.2g})"
    return said + (" enough" if row["enough"] else "")
