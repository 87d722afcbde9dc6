"""A verb of `host` that serves a page, started as a user starts it."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HANGS_S = 300  # ends a test that hangs; none is timed


@dataclass(slots=True)
class ServedPage:
    """Where the page is; what the verb said and its exit code, after the ``with``."""

    url: str
    out: str = ""
    err: str = ""
    code: int | None = None

    def strangers(self, requests: list[str]) -> list[str]:
        """Return the requests that went to anybody but the verb."""
        base = self.url.partition("?")[0]
        return [one for one in requests if not one.startswith((base, "ws" + base[4:]))]


@contextlib.contextmanager
def served_page(folder: Path, *words: str) -> Iterator[ServedPage]:
    """Start `host` with these words in a folder; end it by Ctrl-C behind the ``with``."""
    with subprocess.Popen(
        [sys.executable, "-m", "host", *words],
        cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    ) as running:  # fmt: skip
        assert running.stderr is not None
        said, found = "", None
        for line in running.stderr:
            said += line
            if found := re.search(r"page: (http://127\.0\.0\.1:\d+/\?token=\S+)", line):
                break
        assert found, said
        page = ServedPage(found[1])
        try:
            yield page
        finally:
            running.send_signal(signal.SIGINT)
            page.out, rest = running.communicate(timeout=HANGS_S)
            page.err, page.code = said + rest, running.returncode
