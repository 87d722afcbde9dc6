"""What `host live` shows: bytes that are on disk, through the stream, to whoever looks.

It runs in a thread of its own, not the recorder's: nothing here can hold up or end a recording.
"""

from __future__ import annotations

import contextlib
import json
import queue
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from host.live.flight_state import FlightState
from host.live.ground_capture import GroundCapture
from host.live.live_sample import LIVE_UNITS, LiveUpdate
from host.live.live_sources import Source
from host.live.live_stream import LiveStream
from host.live.recorder import Recorder

_BATCH_S = 0.016  # half a redraw of the page
_STATE_S = 0.2
_REST_S = 0.05
_BIG = 1 << 14
_LEAVE_S = 5.0


class Audience(Protocol):
    """Who is shown the flight; both are called in the session's thread and return at once."""

    def rows(self, message: bytes) -> None:
        """Take rows: see `rows_message`."""
        ...

    def state(self, message: str) -> None:
        """Take the state, JSON."""
        ...


class Listener(Protocol):
    """Who works on the flight and adds to its state; all in the session's thread, none waits."""

    def take(self, data: bytes) -> None:
        """Take bytes of the stream that are on disk and decoded."""
        ...

    def tick(self) -> None:
        """Go on; called five times a second."""
        ...

    def as_json(self) -> dict[str, Any]:
        """Return what the state says under this listener's name."""
        ...


class LiveSession:
    """Shows a source until it ends or is stopped; `recorder` has each byte on disk before.

    Parameters
    ----------
    source : Source
    stream : LiveStream
    capture : GroundCapture or None
        None where the bytes are on disk already.
    tell : callable
        Takes what happens, one line each, for the terminal.
    """

    def __init__(
        self,
        source: Source,
        stream: LiveStream,
        capture: GroundCapture | None,
        tell: Callable[[str], None],
    ) -> None:
        self.source = source
        self.stream = stream
        self.recorder = Recorder(source, capture)
        self.state = FlightState(stream)
        self.audiences: list[Audience] = []
        self.listeners: dict[str, Listener] = {}
        self.ended = threading.Event()  # all that came is shown
        self.enough = threading.Event()  # set by who has what it wanted: the program may end
        self.asked: dict[str, Callable[[dict[str, Any]], None]] = {"mark": self._mark}
        self.beat_s = time.monotonic()  # when the thread that shows last went on
        self._asked: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._tell = tell
        self._marks = 0
        self._shown_s = 0.0
        self._mistaken: set[str] = set()
        self._thread = threading.Thread(target=self._run, name="host live", daemon=True)
        stream.safely = self._safely

    @property
    def capture(self) -> GroundCapture | None:
        """Where the bytes go; None where they go nowhere, or nowhere any more."""
        recorder = self.recorder
        return recorder.capture if recorder.disk_error is None else None

    def start(self) -> None:
        """Begin to receive."""
        self.beat_s = time.monotonic()
        self.recorder.start()
        self._thread.start()

    def stop(self) -> None:
        """End receiving, and wait until the last byte is on disk and, if it can be, shown."""
        self.recorder.stop()
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(_LEAVE_S)

    def mark(self, who: str) -> None:
        """Note an event of the ground; it stands in the capture, never on the card."""
        self.ask({"type": "mark", "who": who})

    def ask(self, what: dict[str, Any]) -> None:
        """Ask for something by its ``type``; whoever is in `asked` answers, in this thread."""
        self._asked.put(what)

    def note(self, kind: str, **what: Any) -> None:
        """Write a note into the capture, where there is one."""
        if self.capture is not None:
            self.capture.note(kind, **what)

    def judged(self, verdict: Mapping[str, Any]) -> None:
        """Note the verdict of a test point, in the thread that feeds."""
        self.state.say("verdict", f"point {verdict['point']}: {verdict['text']}")
        self.note("verdict", **verdict)

    def _run(self) -> None:
        held = bytearray()
        fed_s = time.monotonic()
        arrived_s = 0.0  # of the first byte held
        while not (self._stop.is_set() and self.ended.is_set()):
            last = self.recorder.ended.is_set()  # asked before: what is taken then is all
            portion = self.recorder.take(_REST_S if not held else _BATCH_S)
            now_s = self.beat_s = time.monotonic()
            if portion is not None:
                arrived_s = arrived_s if held else portion.arrived_s
                held += portion.data
            due = now_s - fed_s >= _BATCH_S or len(held) >= _BIG or portion is None
            if held and due:
                self._safely(self._feed, bytes(held), arrived_s)
                held.clear()
                fed_s = now_s
            if portion is not None and portion.text:
                self._safely(self._said, portion.text)
            self._safely(self._answer)
            self._safely(self._show_state)
            if last and portion is None and not self.ended.is_set():
                self._shown_s = 0.0  # the last state is always shown
                self._safely(self._show_state, True)
                self.ended.set()

    def _safely(self, show: Callable[..., None], *given: Any) -> None:
        """Call what shows or judges; a mistake in it is reported once and costs nobody else."""
        try:
            show(*given)
        except BaseException as error:  # an exit that somebody asked for here is a mistake too
            where = str(traceback.extract_tb(error.__traceback__)[-1])
            if where in self._mistaken:
                return
            self._mistaken.add(where)
            with contextlib.suppress(Exception):
                self._said(
                    f"internal error: {type(error).__name__}: {error}; the page may be wrong, the"
                    " recording goes on (please report it)"
                )

    def _feed(self, data: bytes, arrived_s: float) -> None:
        update = self.stream.feed(data, arrived_s)
        self.state.received(len(data), update)
        for listener in self.listeners.values():
            self._safely(listener.take, data)
        for text in update.messages:
            self._tell(text)
            self.note("warning", text=text)
        if len(update) and self.audiences:
            message = rows_message(update)
            for audience in self.audiences:
                self._safely(audience.rows, message)

    def _said(self, text: str) -> None:
        self._tell(text)
        self.state.say("line", text)
        self.note("line", text=text)

    def _answer(self) -> None:
        while not self._asked.empty():
            what = self._asked.get()
            answer = self.asked.get(str(what.get("type")))
            if answer is not None:  # else nobody here: a preflight's word without a preflight
                self._safely(answer, what)

    def _mark(self, what: dict[str, Any]) -> None:
        self._marks += 1
        row = self.state.say("mark", f"mark {self._marks}")
        self.note("mark", number=self._marks, t_s=row["t_s"], who=what["who"])

    def _show_state(self, ended: bool = False) -> None:
        now_s = time.monotonic()
        if now_s - self._shown_s < _STATE_S or not self.audiences:
            return
        self._shown_s = now_s
        what = self.state.as_json() | {
            "type": "state",
            "ended": ended or self.ended.is_set(),
            "source": self.source.name,
            "captured_bytes": self.capture.size_bytes if self.capture else None,
            "capture": self.capture.path.name if self.capture else None,
            "not_recorded": self.recorder.trouble(),
        }
        for name, listener in self.listeners.items():
            self._safely(_add, what, name, listener)
        message = json.dumps(what, allow_nan=False)
        for audience in self.audiences:
            self._safely(audience.state, message)


def _add(what: dict[str, Any], name: str, listener: Listener) -> None:
    listener.tick()
    what[name] = listener.as_json()


def rows_message(update: LiveUpdate) -> bytes:
    """Return rows for a page: little-endian float64.

    First the computer's time at which they were read (ms since 1970) and the number of rows, then
    row by row the columns of `LIVE_UNITS`.
    """
    table = np.stack([update.rows[name] for name in LIVE_UNITS], axis=1)
    head = np.array([update.arrived_s * 1e3, len(table)])
    return np.concatenate([head, table.reshape(-1)]).astype("<f8").tobytes()
