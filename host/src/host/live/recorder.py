"""Bytes of a source onto disk, in a thread of its own: who shows or judges takes them from here.

It calls the source and the disk, and nobody else. What looks at the flight may raise, hang or be
slow: it misses what it misses, and every byte is on disk.
"""

from __future__ import annotations

import math
import queue
import threading
import time
from dataclasses import dataclass

from host.errors import HostError
from host.live.ground_capture import GroundCapture
from host.live.live_sources import Source

_MOST_BYTES = 1 << 24  # on the way to who shows: three quarters of an hour of the radio
_PORTION_BYTES = 100  # what an object takes besides its bytes
_STILL_S = 3.0  # a source yields at least ten times a second, in silence too
_WAIT_S = 0.02
_LEAVE_S = 5.0


@dataclass(frozen=True, slots=True)
class Portion:
    """Bytes that are on disk, or a line on what happened to the source."""

    data: bytes = b""
    arrived_s: float = 0.0  # on the clock of `time.time`
    text: str = ""


class Recorder:
    """Listens to a source until it ends or is stopped.

    Parameters
    ----------
    source : Source
    capture : GroundCapture or None
        None where the bytes are on disk already.

    Attributes
    ----------
    ended : threading.Event
        Nothing comes any more.
    error : Exception or None
        What ended it, where neither the source's end nor `stop` did.
    disk_error : OSError or None
        From then on nothing is recorded.
    looked_s : float
        When the source last yielded, on the clock of `time.monotonic`: the heartbeat. Infinite
        before it did.
    not_shown_bytes : int
        On disk, and never handed on: who shows was too far behind.
    """

    def __init__(self, source: Source, capture: GroundCapture | None) -> None:
        self.capture = capture
        self.ended = threading.Event()
        self.error: Exception | None = None
        self.disk_error: OSError | None = None
        self.looked_s = math.inf
        self.not_shown_bytes = 0
        self._source = source
        self._stop = threading.Event()
        self._portions: queue.SimpleQueue[Portion] = queue.SimpleQueue()
        self._given = self._taken = 0  # each is counted by one thread
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    @property
    def listening(self) -> bool:
        """True while it runs."""
        return self._thread.is_alive()

    def start(self) -> None:
        """Begin to record."""
        self._thread.start()

    def stop(self) -> None:
        """End, and wait until the last byte is on disk."""
        self._stop.set()
        if self.listening:
            self._thread.join(_LEAVE_S)

    def take(self, timeout_s: float) -> Portion | None:
        """Return what came next, None where nothing did in time; for one thread."""
        try:
            portion = self._portions.get(timeout=timeout_s)
        except queue.Empty:
            return None
        self._taken += _size(portion)
        return portion

    def trouble(self) -> str:
        """Return in words why nothing is recorded; empty while all is well.

        A source that ends by itself (a recording played again) is no trouble.
        """
        if self.disk_error is not None and self.capture is not None:
            why = self.disk_error.strerror or self.disk_error
            return f"{self.capture.path.name} takes no more ({why}): NOT RECORDED from here on"
        if self.error is not None:
            recorded = "NOT RECORDED" if self.capture is not None else "nothing received"
            return f"{_words(self.error)}: {recorded} from here on"
        still_s = time.monotonic() - self.looked_s
        if self.listening and still_s > _STILL_S and not self._source.recorded:
            return f"source or disk has not answered for {still_s:.0f} s: NOT RECORDED meanwhile"
        return ""

    def _run(self) -> None:
        try:
            for data in self._source.portions(self._said):
                if data:
                    self._record(data)
                self.looked_s = time.monotonic()
                if self._stop.is_set():
                    break
        except Exception as error:
            self.error = error
        except BaseException as error:  # an exit that a library asked for: not ours to follow
            self.error = RuntimeError(f"{type(error).__name__}: {error}")
        finally:
            self.ended.set()

    def _record(self, data: bytes) -> None:
        """Write to disk first; if it takes no more, go on handing the bytes to who shows."""
        if self.capture is not None and self.disk_error is None:
            try:
                self.capture.write(data)
            except OSError as error:
                self.disk_error = error
        self._hand_on(Portion(data, time.time()))

    def _said(self, text: str) -> None:
        self._hand_on(Portion(text=text))

    def _hand_on(self, portion: Portion) -> None:
        """Queue it; where nobody takes, a recording waits and a flight goes on without."""
        while self._given - self._taken > _MOST_BYTES:
            if not self._source.recorded:
                self.not_shown_bytes += len(portion.data)
                return
            if self._stop.wait(_WAIT_S):
                return
        self._given += _size(portion)
        self._portions.put(portion)


def _size(portion: Portion) -> int:
    return _PORTION_BYTES + len(portion.data) + len(portion.text)


def _words(error: BaseException) -> str:
    if isinstance(error, (HostError, OSError)):
        return str(error)
    return f"internal error: {type(error).__name__}: {error}"
