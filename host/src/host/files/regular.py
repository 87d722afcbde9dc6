"""Checks that a path is a regular file, not a pipe, a device or a folder."""

from __future__ import annotations

import os
from pathlib import Path

from host.errors import UsageError


def regular_file(path: Path, error: type[UsageError] = UsageError) -> Path:
    """Return `path` if it is a file; never opens it, so that no pipe can keep us waiting.

    Raises
    ------
    UsageError
        As `error`: nothing is there, a folder, a pipe or a device.
    """
    try:
        there = _there(path, error)
    except OSError as reason:
        raise error(f"{path}: cannot be read: {reason.strerror or reason}") from None
    if there.is_dir():
        raise error(f"{path}: a folder; name a file in it")
    return there


def file_or_folder(path: Path, error: type[UsageError] = UsageError) -> Path:
    """Return `path` if it is a file or a folder.

    Raises
    ------
    UsageError
        As `error`: nothing is there, or a pipe or a device, which cannot be read twice.
    """
    try:
        return _there(path, error)
    except OSError as reason:
        raise error(f"{path}: cannot be read: {reason.strerror or reason}") from None


def _there(path: Path, error: type[UsageError]) -> Path:
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise error(f"{path}: no such file or folder") from None
    except ValueError:  # a NUL in its name
        raise error(f"{str(path)!r}: no name of a file") from None
    if not path.is_file() and not path.is_dir():
        raise error(f"{path}: a pipe or a device, expected a file: save it to one first")
    if not os.access(path, os.R_OK):
        raise error(f"{path}: not allowed to be read; who owns it?")
    return path
