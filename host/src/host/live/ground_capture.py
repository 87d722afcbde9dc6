"""What is received, on disk before anybody looks at it, and its notes."""

from __future__ import annotations

import contextlib
import json
import os
import time
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from host.errors import UsageError
from host.log.capture_head import SUFFIX, CaptureHead, notes_path

_CLOSED = -1  # a number that no file has: who comes late writes into nobody else's
_SYNC_S = 1.0  # what a computer may lose that loses its power; a program that dies loses nothing


class GroundCapture:
    """A file of the bytes as they came, and one of notes; ``with`` closes them.

    Parameters
    ----------
    path : Path
        Where the bytes go; never over a file that is there.
    head : CaptureHead

    Raises
    ------
    UsageError
        If there is such a file, or it cannot be made.
    """

    def __init__(self, path: Path, head: CaptureHead) -> None:
        self.path = path
        self.size_bytes = 0
        self._synced_s = time.monotonic()
        self._bytes = _new_file(path)
        try:
            self._notes = _new_file(notes_path(path))
        except UsageError:
            os.close(self._bytes)
            path.unlink()
            raise
        _write_all(self._notes, head.line().encode())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for file in (self._bytes, self._notes):
            with contextlib.suppress(OSError):  # a disk that is gone was reported when it went
                os.fsync(file)
            os.close(file)
        self._bytes = self._notes = _CLOSED

    def write(self, data: bytes) -> None:
        """Write bytes; when this returns the system has them.

        Raises
        ------
        OSError
            If the disk is full or gone; what was written stays.
        """
        _write_all(self._bytes, data)
        self.size_bytes += len(data)
        now_s = time.monotonic()
        if now_s - self._synced_s > _SYNC_S:
            os.fsync(self._bytes)
            self._synced_s = now_s

    def note(self, kind: str, **what: Any) -> dict[str, Any]:
        """Write a note with the place in the stream and the computer's time; return it."""
        row = {"kind": kind, "byte": self.size_bytes, "utc": utc_now()} | what
        _write_all(self._notes, (json.dumps(row) + "\n").encode())
        os.fsync(self._notes)
        return row


def utc_now() -> str:
    """Return the computer's time, ISO 8601 to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def new_capture_path(folder: Path) -> Path:
    """Return the name of a new capture: its time of day is that of the computer."""
    stem = datetime.now().strftime("RADIO-%Y%m%d-%H%M%S")
    for number in range(100):
        path = folder / f"{stem}{f'-{number}' if number else ''}{SUFFIX}"
        if not path.exists() and not notes_path(path).exists():
            return path
    raise UsageError(f"{folder}: a hundred captures of this second; name one with -o")


def _new_file(path: Path) -> int:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
    try:
        return os.open(path, flags, 0o644)
    except FileExistsError:
        raise UsageError(f"{path}: there already; a capture never writes over a file") from None
    except OSError as error:
        raise UsageError(f"{path}: cannot be made: {error.strerror or error}") from None


def _write_all(file: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(file, view) :]
