"""What a web server logs of strangers' requests: a line a minute for the pilot, in our words."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

_EVERY_S = 60.0
_LOGGERS = ("aiohttp", "asyncio")


class RequestNoise(logging.Handler):
    """Counts what is logged and tells it at most once a minute, without a word of who asked.

    Parameters
    ----------
    tell : callable
        Takes the line.
    clock : callable
    """

    def __init__(
        self, tell: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__()
        self._tell, self._clock = tell, clock
        self._reported_s: float | None = None
        self._more = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Tell of it, or count it."""
        now_s = self._clock()
        if self._reported_s is not None and now_s - self._reported_s < _EVERY_S:
            self._more += 1
            return
        kind = record.exc_info[0] if record.exc_info else None
        what = kind.__name__ if kind is not None else record.levelname.lower()
        more = f", and {self._more} more since the last such line" if self._more else ""
        self._reported_s, self._more = now_s, 0
        self._tell(f"page: a request that is none was refused ({what}){more}")


def quieten(tell: Callable[[str], None]) -> None:
    """Let the web server's log come as `RequestNoise`, not as tracebacks on the terminal."""
    noise = RequestNoise(tell)
    for name in _LOGGERS:
        logger = logging.getLogger(name)
        logger.handlers[:] = [noise]
        logger.propagate = False
