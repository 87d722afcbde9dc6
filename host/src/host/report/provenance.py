"""Provenance of a report: versions, hashes of every file, the command line."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

_PIECE = 1 << 20
_LIBRARIES = ("numpy", "scipy", "pandas", "matplotlib")


def versions() -> dict[str, str]:
    """Return the versions of this package, of Python and of the libraries that compute."""
    from host import __version__

    found = {"host": __version__, "Python": platform.python_version()}
    for name in _LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "missing"
    return found


def hashes(paths: Iterable[Path]) -> dict[str, str]:
    """Return the SHA-256 of every path that is a file, by its name as given."""
    found: dict[str, str] = {}
    for path in paths:
        if path.is_file():
            digest = hashlib.sha256()
            with path.open("rb") as file:
                while piece := file.read(_PIECE):
                    digest.update(piece)
            found[str(path)] = digest.hexdigest()
    return found
