"""Read what a person wrote as TOML: by name or path, every mistake one line.

Aircraft, linear aircraft and flight cards come through here: each packaged under a name or a file
of the user's, `format = 1`, numbers that are finite numbers. Which error class a mistake is, the
caller says.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TypeGuard

from host.errors import UsageError
from host.files.user_text import read_toml, shown
from host.near_names import like

FORMAT = 1


def read(source: str | Path, folder: Path, what: str, error: type[UsageError]) -> dict[str, object]:
    """Return a document.

    Parameters
    ----------
    source : str or Path
        Name of a packaged file, or path of one: that has a folder or ends in ``.toml``.
    folder : Path
        Where the packaged ones are.
    what : str
        What it should be, in words: ``aircraft``.
    error : type
        What to raise.

    Raises
    ------
    UsageError
        As `error`: no such file, one that cannot be read, or not TOML.
    """
    path = Path(source)
    if path.suffix != ".toml" and path.name == str(source):
        path = folder / f"{source}.toml"
    if not path.exists():
        known = ", ".join(names(folder))
        meant = like(str(source), names(folder))
        raise error(f"no {what} {str(source)!r}{meant}: expected a file or one of {known}")
    return read_toml(path, error)


def check_format(document: Mapping[str, object], name: str, error: type[UsageError]) -> None:
    """Raise `error` if the format of a document is not ours."""
    if document.get("format") != FORMAT:
        raise error(f"{name}: format is {document.get('format')!r}, expected {FORMAT}")


def names(folder: Path) -> list[str]:
    """Return the names of the packaged files, sorted."""
    return sorted(path.stem for path in folder.glob("*.toml"))


def is_mapping(value: object) -> TypeGuard[Mapping[str, object]]:
    """Return whether a value is a table."""
    return isinstance(value, dict)


def number(where: str, value: object, error: type[UsageError]) -> float:
    """Return a finite number; raise `error`, which names the place, if it is none."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise error(f"{where} is {shown(value)}, expected a number")
    return float(value)


def listed(where: str, value: object, error: type[UsageError]) -> list[object]:
    """Return a list; raise `error` if it is none."""
    if not isinstance(value, list):
        raise error(f"{where} is {shown(value)}, expected a list of numbers")
    return value
