"""A progress bar on a terminal's stderr for long work; silent everywhere else."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from host.terminal import bar

_WIDTH = 32
_EVERY_S = 0.1


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
        filled = round(share * _WIDTH)
        bar.draw(f"{label:8s} [{'#' * filled}{'.' * (_WIDTH - filled)}] {share:4.0%}")
