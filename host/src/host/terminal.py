"""What a terminal is given: text that it cannot obey, and never half a line of each stream."""

from __future__ import annotations

import contextlib
import os
import shlex
import shutil
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

from host.colours import coloured, painted
from host.text import shown


def cleaned(text: str) -> str:
    r"""Return lines whose control codes, and bytes of names that are no UTF-8, show as ``\x1b``."""
    return "\n".join(map(shown, text.split("\n")))


def command_line(*words: str | Path) -> str:
    """Return a command that a user can copy: paths quoted as the shell of this system wants it.

    Parameters
    ----------
    *words : str or Path
        The program and its arguments; a `Path` that begins with a dash gets its folder.
    """
    texts = [f".{os.sep}{w}" if isinstance(w, Path) and f"{w}"[0] == "-" else f"{w}" for w in words]
    if sys.platform == "win32":
        import subprocess

        return subprocess.list2cmdline(texts)
    return " ".join(map(_quoted, texts))


def _quoted(text: str) -> str:
    if shown(text) == text:
        return shlex.quote(text)
    plain = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"$'{shown(plain)}'"


class Bar:
    """The one progress bar on standard error; whatever is written next takes its place."""

    def __init__(self) -> None:
        self._on: TextIO | None = None
        self._lock = threading.Lock()  # a second thread draws where a verb takes long

    def draw(self, text: str) -> None:
        """Draw the bar over the last one, as much of it as fits on a line."""
        with self._lock:
            stream = bare(sys.stderr)
            if self._on is None:
                sys.stdout.flush()
            stream.write(f"\r\033[K{cleaned(text)[: shutil.get_terminal_size().columns - 1]}")
            stream.flush()
            self._on = stream

    def clear(self) -> None:
        """Take the bar away if one is drawn."""
        with self._lock:
            stream, self._on = self._on, None
            if stream is not None:
                with contextlib.suppress(OSError, ValueError):
                    stream.write("\r\033[K")
                    stream.flush()


bar = Bar()


class _Cleaned:
    """A stream that shows what it is given, behind what the other one was given before."""

    def __init__(self, stream: TextIO, other: TextIO) -> None:
        self.bare = stream
        self._other = other
        self._coloured = coloured(stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.bare, name)

    def write(self, text: str) -> int:
        bar.clear()
        with contextlib.suppress(OSError, ValueError):  # whose reader left says so itself
            self._other.flush()
        encoding = self.bare.encoding or "utf-8"
        shown = cleaned(text).encode(encoding, "backslashreplace").decode(encoding)
        self.bare.write(painted(shown) if self._coloured else shown)
        return len(text)


def bare(stream: TextIO) -> TextIO:
    """Return the stream under a cleaned one, for codes that a terminal should obey."""
    return getattr(stream, "bare", stream)


@contextlib.contextmanager
def cleaned_streams() -> Iterator[None]:
    """Clean what goes to stdout and stderr, and let neither begin within a line of the other."""
    out = sys.stdout or Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115  a closed one
    err = sys.stderr or Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115
    wrapped: tuple[Any, Any] = _Cleaned(out, err), _Cleaned(err, out)
    with contextlib.redirect_stdout(wrapped[0]), contextlib.redirect_stderr(wrapped[1]):
        try:
            yield
        finally:
            bar.clear()
