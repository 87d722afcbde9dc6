"""The file of an autopilot's law: its parameters, their ranges, what its modes are called."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from host.control.autopilots.structure import Setting


@cache
def _document(autopilot: str) -> dict[str, Any]:
    place = Path(__file__).with_name(f"{autopilot}.toml")
    return tomllib.loads(place.read_text(encoding="utf-8"))


def settings(autopilot: str, axis: str) -> dict[str, Setting]:
    """Return the tuned parameters of an axis by their role."""
    return {role: Setting(*listed) for role, listed in _document(autopilot)[axis].items()}


def releases(autopilot: str) -> tuple[str, ...]:
    """Return the oldest and the newest release that was read; none where there are none."""
    return tuple(_document(autopilot).get("releases", ()))


def renamed(autopilot: str) -> Mapping[str, tuple[str, str]]:
    """Return by today's name the older one, and the first release with today's."""
    found: Mapping[str, tuple[str, str]] = _document(autopilot).get("renamed", {})
    return found


def _names(autopilot: str, name: str) -> list[str]:
    """Return the names that a log may have for a parameter, today's last."""
    older = renamed(autopilot).get(name)
    return [older[0], name] if older else [name]


def fixed(
    autopilot: str, names: Mapping[str, str], logged: Mapping[str, float]
) -> dict[str, float]:
    """Return the parameters that stay: a log's own, defaults where it has none.

    Parameters
    ----------
    autopilot : str
    names : mapping of str to str
        The autopilot's own name of each.
    logged : mapping of str to float
        Parameters by the autopilot's names, of any release that was read.
    """
    known = {
        key: float(logged[one])
        for key, name in names.items()
        for one in _names(autopilot, name)
        if one in logged
    }
    return {**_document(autopilot)["fixed"], **known}


def assumed(
    autopilot: str, names: Mapping[str, str], logged: Mapping[str, float]
) -> tuple[str, ...]:
    """Return the names of parameters that stay and that a log has not."""
    return tuple(n for n in names.values() if not logged.keys() & set(_names(autopilot, n)))


def named(autopilot: str, table: str, logged: Mapping[str, float]) -> dict[str, float]:
    """Return parameters of a table by the autopilot's own names, a log's where it has them."""
    return {k: float(logged.get(k, usual)) for k, usual in _document(autopilot)[table].items()}


def words(autopilot: str) -> Mapping[str, str]:
    """Return what the first flight's page calls its modes and gains."""
    found: Mapping[str, str] = _document(autopilot)["words"]
    return found


def smoothing(corner_hz: float, period_s: float) -> float:
    """Return what a first-order filter takes of a new value; a corner of 0 is no filter."""
    if corner_hz <= 0.0:
        return 1.0
    return period_s / (period_s + 1.0 / (2.0 * math.pi * corner_hz))
