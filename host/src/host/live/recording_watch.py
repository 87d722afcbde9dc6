"""Whether the flight is recorded and shown: asked by the program's own loop, said at once.

Neither the thread that records nor the one that shows is needed to hear that it has ended.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable

from host.live.live_session import LiveSession

BEAT_S = 1.0
_STANDS_S = 3.0


class RecordingWatch:
    """Looks at a session; tells the terminal what goes wrong, and the page every second.

    Parameters
    ----------
    session : LiveSession
    tell : callable
        Takes a line for the terminal, once for each trouble.

    Attributes
    ----------
    say : callable
        Takes the heartbeat for a page, JSON: ``bytes`` on disk (None where they are there already)
        and ``trouble`` in words, empty while all is well.
    """

    def __init__(self, session: LiveSession, tell: Callable[[str], None]) -> None:
        self.say: Callable[[str], None] = lambda message: None
        self._session = session
        self._tell = tell
        self._reported = ""
        self._said: tuple[float, str] | None = None

    def look(self) -> None:
        """Look at both threads; called several times a second."""
        now_s = time.monotonic()
        trouble = self._trouble(now_s)
        kind = trouble.partition(" for ")[0]  # without its seconds
        if kind and kind != self._reported:
            self._tell(trouble)
        self._reported = kind
        if self._said is not None and now_s - self._said[0] < BEAT_S and kind == self._said[1]:
            return
        self._said = now_s, kind
        capture = self._session.recorder.capture
        beat = {
            "type": "recording",
            "bytes": capture.size_bytes if capture is not None else None,
            "trouble": trouble,
        }
        self.say(json.dumps(beat))

    def _trouble(self, now_s: float) -> str:
        trouble = self._session.recorder.trouble()
        if trouble:
            return trouble
        stands_s = now_s - self._session.beat_s
        if stands_s > _STANDS_S:
            recorded = "" if self._session.capture is None else "; the recording goes on"
            return f"what is shown has stood still for {stands_s:.0f} s{recorded}"
        missed = self._session.recorder.not_shown_bytes
        return f"{missed} bytes came too fast to be shown; they are on disk" if missed else ""
