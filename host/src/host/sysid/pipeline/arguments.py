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

from host.errors import IdentificationError
from host.sysid.maneuvers.maneuver_selection import TimeSpan


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


def of_each_flight(name: str, given: Any, flights: int) -> list[Path | None]:
    """Return a path of each flight, of one for all or of one of each (None where there is none).

    Raises
    ------
    IdentificationError
        If their number is another, or one is of another type.
    """
    if not isinstance(given, list | tuple):
        return [path_of(name, given)] * flights
    if len(given) != flights:
        raise IdentificationError(
            f"argument {name}: {len(given)} for {flights} flights; give one for all, or one of each"
        )
    return [path_of(name, one) for one in given]


def stretches_of(given: Any, flights: int) -> list[tuple[TimeSpan, ...]]:
    """Return the stretches of each flight.

    Parameters
    ----------
    given : pair, list of pairs, or a list with one of these (or None) for each flight
        From and to, s; None is the end of the record. One flight needs no outer list.
    flights : int

    Raises
    ------
    IdentificationError
        If it is something else.
    """
    if given is None:
        return [()] * flights
    if flights == 1 and (found := _pairs(given)) is not None:
        return [found]
    each = [() if one is None else _pairs(one) for one in given] if listed(given) == given else []
    if len(each) != flights:
        raise IdentificationError(
            f"argument stretches: {len(each)} for {flights} flights; give a list for each flight,"
            " such as [[(10, 35), (60, 80)], [(5, 20)]]"
        )
    wrong = [number for number, one in enumerate(each, start=1) if one is None]
    if wrong:
        raise IdentificationError(
            f"argument stretches of flight {wrong[0]} are no pairs of times, such as [(10, 35)]"
        )
    return [one for one in each if one is not None]


def chosen_stretches(
    stretches: Any, from_s: Any, to_s: Any, flights: int
) -> list[tuple[TimeSpan, ...]]:
    """Return the stretches of each flight, given as such or as one for every flight.

    Raises
    ------
    IdentificationError
        If both are given, or one is not what it should be.
    """
    ends = seconds_of("from_s", from_s), seconds_of("to_s", to_s)
    if ends == (None, None):
        return stretches_of(stretches, flights)
    if stretches is not None:
        raise IdentificationError(
            "argument stretches excludes argument from_s and argument to_s: give one of them"
        )
    return [(ends,)] * flights


def _pairs(given: Any) -> tuple[TimeSpan, ...] | None:
    """Return a pair of times or several as several; None of anything else."""
    if _is_pair(given):
        given = [given]
    if not isinstance(given, list | tuple) or not all(map(_is_pair, given)):
        return None
    return tuple((_seconds(first), _seconds(last)) for first, last in given)


def _is_pair(given: Any) -> bool:
    return (
        isinstance(given, list | tuple)
        and len(given) == 2
        and all(end is None or isinstance(end, Real) for end in given)
    )


def _seconds(end: Real | None) -> float | None:
    return None if end is None else float(end)


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
    "accept": "--accept", "aircraft": "--aircraft", "calibration": "--calibration",
    "from_s": "--from", "history": "--history",
    "maneuvers": "--maneuver", "mapping": "--map", "mat": "--mat", "methods": "--method",
    "models": "--model", "plots": "--plots", "prior": "--prior", "row_rate_hz": "--row-rate",
    "save_aircraft": "--save-aircraft", "save_model": "--save-model", "to_s": "--to",
    "truth": "--truth",
}  # fmt: skip
_ARGUMENT = re.compile(rf"\bargument ({'|'.join(OPTIONS)})\b")


def option_words(text: str) -> str:
    """Return a message with the options of the command line in place of the arguments."""
    return _ARGUMENT.sub(lambda found: OPTIONS[found[1]], text)


def _other(name: str, given: Any, expected: str) -> IdentificationError:
    return IdentificationError(f"{name} is of type {type(given).__name__}, expected {expected}")
