"""`host live --json`: what the page shows, as lines."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

from host.live.live_session import Audience

if TYPE_CHECKING:
    pass


class JsonLines(Audience):
    """The state, one line of JSON a second; each verdict of a test point a line at once."""

    def __init__(self, show: Callable[[str], None]) -> None:
        self._show = show
        self._last = self._verdict = 0
        self._ended = False

    def rows(self, message: bytes) -> None:
        """Not shown."""

    def state(self, message: str) -> None:
        """Show new verdicts, and every fifth state, for five come in a second; and the last."""
        self._last += 1
        said = json.loads(message)
        for verdict in said.get("test_point", {}).get("verdicts", []):
            if verdict["number"] > self._verdict:
                self._verdict = verdict["number"]
                self._show(json.dumps({"type": "verdict"} | verdict))
        ended = said.get("ended", False)
        last, self._ended = ended and not self._ended, ended
        if self._last % 5 == 1 or last:
            self._show(json.dumps(said))
