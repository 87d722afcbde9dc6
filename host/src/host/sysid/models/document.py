"""What a user wrote as TOML, parsed, every mistake one line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from host.sysid.errors import IdentificationError


def read_document(path: Path) -> dict[str, Any]:
    """Return a TOML file's tables.

    Raises
    ------
    IdentificationError
        If it cannot be read or is no TOML; the line says where.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise IdentificationError(f"{path}: cannot be read ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise IdentificationError(f"{path}: not TOML: {error}") from error
