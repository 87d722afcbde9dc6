"""Temporary name of a file until it is complete."""

from __future__ import annotations

import os
from pathlib import Path


def unfinished(path: Path) -> Path:
    """Return a name beside `path`, with its ending.

    The process is in it, so that it is no file of the user's, nor another run's.
    """
    return path.with_name(f"{path.stem}.part{os.getpid()}{path.suffix}")
