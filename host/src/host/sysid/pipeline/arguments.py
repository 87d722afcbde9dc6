"""Types of the arguments of `host.identify`: converted, or refused in one line by name.

Messages name an argument as ``argument NAME``; the verbs replace that by the option of the command
line (`option_words`).
"""

from __future__ import annotations

import os
import re
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
    """Return a list of paths, of one path or several; empty for None.

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
    """Return integers, of one or several.

    Raises
    ------
    IdentificationError
        If one is no integer.
    """
    found = listed(given)
    for one in found:
        if not isinstance(one, Integral):
            raise _other(name, one, "whole numbers, such as [1, 3]")
    return tuple(map(int, found))


def listed(given: Any) -> list[Any]:
    """Return a list of what was given; a single object makes a list of one, None an empty one."""
    if given is None:
        return []
    if isinstance(given, Iterable) and not isinstance(given, str | bytes):
        return list(given)
    return [given]


OPTIONS = {
    "aircraft": "--aircraft", "calibration": "--calibration", "from_s": "--from",
    "maneuvers": "--maneuver", "mapping": "--map", "mat": "--mat", "methods": "--method",
    "models": "--model", "plots": "--plots", "prior": "--prior",
    "save_aircraft": "--save-aircraft", "save_model": "--save-model", "to_s": "--to",
    "truth": "--truth",
}  # fmt: skip
_ARGUMENT = re.compile(rf"\bargument ({'|'.join(OPTIONS)})\b")


def option_words(text: str) -> str:
    """Return a message with the options of the command line in place of the arguments."""
    return _ARGUMENT.sub(lambda found: OPTIONS[found[1]], text)


def _other(name: str, given: Any, expected: str) -> IdentificationError:
    return IdentificationError(f"{name} is of type {type(given).__name__}, expected {expected}")
