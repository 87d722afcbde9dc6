"""The one loop of `host live`: bytes to disk, then to the stream, then to whoever looks.

It runs in a thread of its own: no viewer, bridge or page can hold it up.
"""

from __future__ import annotations

import json
import queue
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from host.errors import HostError
from host.live.flight_state import FlightState
from host.live.ground_capture import GroundCapture
from host.live.live_sample import LIVE_UNITS, LiveUpdate
from host.live.live_sources import Source
from host.live.live_stream import LiveStream

_BATCH_S = 0.016  # half a redraw of the page
_STATE_S = 0.2
_REST_S = 0.05
_BIG = 1 << 14


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
    """Receives a source until it ends or is told to.

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
        self.capture = capture
        self.state = FlightState(stream)
        self.audiences: list[Audience] = []
        self.listeners: dict[str, Listener] = {}
        self.ended = threading.Event()
        self.enough = threading.Event()  # set by who has what it wanted: the program may end
        self.asked: dict[str, Callable[[dict[str, Any]], None]] = {}  # by type; who answers
        self.error: BaseException | None = None
        self.disk_error: OSError | None = None  # from then on nothing is recorded
        self._asked: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._tell = tell
        self._marks = 0
        self._mistake: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="host live", daemon=True)

    def start(self) -> None:
        """Begin to receive."""
        self._thread.start()

    def stop(self) -> None:
        """End receiving, and wait until the last byte is on disk."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    def mark(self, who: str) -> None:
        """Note an event of the ground; it stands in the capture, never on the card."""
        self.ask({"type": "mark", "who": who})

    def ask(self, what: dict[str, Any]) -> None:
        """Ask for something; it is answered in the session's thread."""
        self._asked.put(what)

    def note(self, kind: str, **what: Any) -> None:
        """Write a note into the capture, where there is one; in the session's thread."""
        if self.capture is not None:
            self.capture.note(kind, **what)

    def _run(self) -> None:
        try:
            self._receive()
        except (HostError, OSError) as error:
            self.error = error
        finally:
            self.ended.set()
        while self.error is None and not self._stop.wait(_REST_S):
            self._answer()
            self._safely(self._show_state)

    def _receive(self) -> None:
        held = bytearray()
        fed_s = self._shown_s = 0.0
        arrived_s = 0.0  # of the first byte held
        for data in self.source.portions(self._said):
            if data and self.capture is not None:
                self._written(self.capture, data)
            arrived_s = arrived_s if held else time.time()
            held += data
            now_s = time.monotonic()
            if held and (now_s - fed_s >= _BATCH_S or len(held) >= _BIG):
                self._safely(self._feed, bytes(held), arrived_s)
                held.clear()
                fed_s = now_s
            self._answer()
            self._safely(self._show_state)
            if self._stop.is_set():
                break
        if held:
            self._safely(self._feed, bytes(held), arrived_s)

    def _safely(self, show: Callable[..., None], *given: Any) -> None:
        """Show something; a mistake of ours in it is told once and never ends the recording."""
        try:
            show(*given)
        except Exception as error:
            if self._mistake is None:
                self._mistake = error
                self._said(
                    f"internal error: {type(error).__name__}: {error}; the page may be wrong, the"
                    " recording goes on (please report it)"
                )

    def _written(self, capture: GroundCapture, data: bytes) -> None:
        """Write to disk; if it takes no more, say so and go on showing the flight."""
        try:
            capture.write(data)
        except OSError as error:
            self.capture = None
            self.disk_error = error
            self._said(
                f"{capture.path} takes no more ({error.strerror}): NOT RECORDED from here on"
            )

    def _feed(self, data: bytes, arrived_s: float) -> None:
        update = self.stream.feed(data, arrived_s)
        self.state.received(len(data), update)
        for listener in self.listeners.values():
            listener.take(data)
        for text in update.messages:
            self._noted("warning", text)
            self._tell(text)
        if len(update) and self.audiences:
            message = rows_message(update)
            for audience in self.audiences:
                audience.rows(message)

    def judged(self, verdict: Mapping[str, Any]) -> None:
        """Note the verdict of a test point, in the thread that feeds."""
        self.state.say("verdict", f"point {verdict['point']}: {verdict['text']}")
        if self.capture is not None:
            self.capture.note("verdict", **verdict)

    def _said(self, text: str) -> None:
        self._tell(text)
        self._noted("line", text)
        self.state.say("line", text)

    def _noted(self, kind: str, text: str) -> None:
        if self.capture is not None:
            self.capture.note(kind, text=text)

    def _answer(self) -> None:
        while not self._asked.empty():
            asked = self._asked.get()
            if asked["type"] in self.asked:
                self._safely(self.asked[asked["type"]], asked)
                continue
            self._marks += 1
            row = self.state.say("mark", f"mark {self._marks}")
            if self.capture is not None:
                self.capture.note("mark", number=self._marks, t_s=row["t_s"], who=asked["who"])

    def _show_state(self) -> None:
        now_s = time.monotonic()
        if now_s - self._shown_s < _STATE_S or not self.audiences:
            return
        self._shown_s = now_s
        for listener in self.listeners.values():
            listener.tick()
        capture = self.capture
        what = self.state.as_json() | {
            "type": "state",
            "ended": self.ended.is_set(),
            "source": self.source.name,
            "captured_bytes": capture.size_bytes if capture else None,
            "capture": capture.path.name if capture else None,
            "not_recorded": self.disk_error is not None,
        }
        what |= {name: listener.as_json() for name, listener in self.listeners.items()}
        message = json.dumps(what, allow_nan=False)
        for audience in self.audiences:
            audience.state(message)

    _shown_s = 0.0


def rows_message(update: LiveUpdate) -> bytes:
    """Return rows for a page: little-endian float64.

    First the computer's time at which they were read (ms since 1970) and the number of rows, then
    row by row the columns of `LIVE_UNITS`.
    """
    table = np.stack([update.rows[name] for name in LIVE_UNITS], axis=1)
    head = np.array([update.arrived_s * 1e3, len(table)])
    return np.concatenate([head, table.reshape(-1)]).astype("<f8").tobytes()
