"""What a notebook gives as an argument: taken if it can be meant, else named in a line."""

from __future__ import annotations

import os
from collections.abc import Iterable
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from host.sysid.identification_error import IdentificationError


def path_of(name: str, given: Any) -> Path | None:
    """Return a path, None where none is given.

    Raises
    ------
    IdentificationError
        If it is of another type.
    """
    if given is None:
        return None
    if not isinstance(given, str | os.PathLike):
        raise _other(name, given, "a path")
    return Path(given)


def paths_of(name: str, given: Any) -> list[Path]:
    """Return paths one by one; one alone is one, None is none.

    Raises
    ------
    IdentificationError
        If one is of another type.
    """
    found = [path_of(name, one) for one in listed(given)]
    return [path for path in found if path is not None]


def seconds_of(name: str, given: Any) -> float | None:
    """Return a time, s, None where none is given.

    Raises
    ------
    IdentificationError
        If it is no number.
    """
    if given is None:
        return None
    if not isinstance(given, Real):
        raise _other(name, given, "a number of seconds")
    return float(given)


def numbers_of(name: str, given: Any) -> tuple[int, ...]:
    """Return whole numbers; one alone is one.

    Raises
    ------
    IdentificationError
        If one is none.
    """
    found = listed(given)
    for one in found:
        if not isinstance(one, Integral):
            raise _other(name, one, "whole numbers, such as [1, 3]")
    return tuple(map(int, found))


def listed(given: Any) -> list[Any]:
    """Return what was given one by one; a name or a thing alone is one, None is none."""
    if given is None:
        return []
    if isinstance(given, Iterable) and not isinstance(given, str | bytes):
        return list(given)
    return [given]


def _other(name: str, given: Any, expected: str) -> IdentificationError:
    return IdentificationError(f"{name} is of type {type(given).__name__}, expected {expected}")
