"""A file object that draws a progress bar while a library reads it."""

from __future__ import annotations

import io
from pathlib import Path
from typing import BinaryIO, cast

from host.progress import progress_bar

_BUFFER_BYTES = 1 << 20  # the bar is looked at once a buffer, not once a read


class _Counted(io.FileIO):
    """Tells a bar how far it was read."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._size = path.stat().st_size
        self._draw = progress_bar("reading", self._size)

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        """Read into a buffer, and draw."""
        count = super().readinto(buffer)
        if self._draw is not None:
            self._draw(self.tell(), self._size)
        return count


def watched_file(path: Path) -> BinaryIO:
    """Open a file to read; on a terminal a bar shows how far a large one was read.

    Parameters
    ----------
    path : Path
    """
    return cast("BinaryIO", io.BufferedReader(_Counted(path), _BUFFER_BYTES))
