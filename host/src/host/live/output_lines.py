"""Lines for a terminal or a pipe whose reader may rest (Ctrl-S, a pager): nothing waits for it."""

from __future__ import annotations

import contextlib
import queue
import sys
import threading
from typing import TextIO

_MOST = 1000  # a quarter of an hour of the state once a second


class OutputLines:
    """Prints lines in a thread of its own, in the order they were given.

    A pipe holds 64 kB. Whoever prints into a full one waits until somebody reads, and the thread
    that receives the radio must not.
    """

    def __init__(self) -> None:
        self._lines: queue.Queue[tuple[TextIO, str] | None] = queue.Queue(_MOST)
        self._left_out = 0
        self._counting = threading.Lock()
        self._gone: set[int] = set()
        self._thread = threading.Thread(target=self._run, name="output lines", daemon=True)
        self._thread.start()

    def out(self, line: str) -> None:
        """Print a line on standard output; returns at once."""
        self._put(sys.stdout, line)

    def err(self, line: str) -> None:
        """Print a line on standard error; returns at once."""
        self._put(sys.stderr, line)

    def close(self) -> None:
        """Wait until every line that was kept is read."""
        self._lines.put(None)
        self._thread.join()

    def _put(self, stream: TextIO, line: str) -> None:
        try:
            self._lines.put_nowait((stream, line))
        except queue.Full:
            with self._counting:
                self._left_out += 1

    def _run(self) -> None:
        while (given := self._lines.get()) is not None:
            self._print(*given)
            self._tell_left_out()
        self._tell_left_out()

    def _tell_left_out(self) -> None:
        with self._counting:
            count, self._left_out = self._left_out, 0
        if count:
            self._print(sys.stderr, f"host: {count} lines are left out: nobody read them")

    def _print(self, stream: TextIO, line: str) -> None:
        if id(stream) in self._gone:
            return
        try:
            print(line, file=stream, flush=True)
        except OSError as error:
            self._gone.add(id(stream))
            if stream is not sys.stderr:
                with contextlib.suppress(OSError):
                    print(
                        f"host: standard output takes no more lines ({error.strerror}); what is"
                        " received is still recorded",
                        file=sys.stderr,
                        flush=True,
                    )
