"""Read a TOML file of the user; every mistake is one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from host.errors import IdentificationError
from host.files.user_text import read_toml


def read_document(path: Path) -> dict[str, Any]:
    """Return a TOML file's tables.

    Raises
    ------
    IdentificationError
        If it cannot be read or is no TOML; the line says where.
    """
    return read_toml(path, IdentificationError)
