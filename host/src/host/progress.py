"""What a terminal shows of work that takes long; silent everywhere else."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator

from host.terminal import bar

_WIDTH = 32
_EVERY_S = 0.1
_PATIENCE_S = 2.0  # what takes less is over before anybody wonders
_TICK_S = 0.5


class _Watch:
    """What is being done, since when, and when a bar was drawn last."""

    def __init__(self) -> None:
        self.stage = ""
        self.shown_s = 0.0


_watch = _Watch()


def stage(text: str) -> None:
    """Say what is being done now; shown with the seconds where a verb takes long."""
    _watch.stage = text


@contextlib.contextmanager
def watched(verb: str, *, shown: bool) -> Iterator[None]:
    """Show on a terminal that a verb works, what at, and since when, once it takes over 2 s.

    Parameters
    ----------
    verb : str
    shown : bool
        False for verbs that draw for themselves.
    """
    if not (shown and sys.stderr.isatty()):
        yield
        return
    over = threading.Event()
    began_s = time.monotonic()
    _watch.stage = ""

    def look() -> None:
        while not over.wait(_TICK_S):
            now_s = time.monotonic()
            if now_s - began_s > _PATIENCE_S and now_s - _watch.shown_s > _PATIENCE_S:
                bar.draw(f"{verb}  {_watch.stage:s}  {now_s - began_s:.0f} s")

    watcher = threading.Thread(target=look, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()
        bar.clear()


def progress_bar(label: str, size_bytes: int) -> Callable[[int, int], None] | None:
    """Return a function that draws a bar, or None where nobody would see it or need it.

    Parameters
    ----------
    label : str
        Text in front of the bar.
    size_bytes : int
        Size of the file; below 20 MB the work is over before a bar helps.
    """
    if size_bytes < 20_000_000 or not sys.stderr.isatty():
        return None
    last_s = 0.0

    def draw(done: int, total: int) -> None:
        nonlocal last_s
        now_s = time.monotonic()
        if done < total and now_s - last_s < _EVERY_S:
            return
        last_s = now_s
        draw_share(label, done / total if total else 1.0)
        if done >= total:
            bar.clear()

    return draw


def draw_share(label: str, share: float) -> None:
    """Draw a bar if somebody watches; the next line that is printed takes its place."""
    if sys.stderr.isatty():
        _watch.shown_s = time.monotonic()
        filled = round(share * _WIDTH)
        bar.draw(f"{label:8s} [{'#' * filled}{'.' * (_WIDTH - filled)}] {share:4.0%}")
