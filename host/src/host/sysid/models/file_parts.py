"""Parts that files of linear models and of equations share: names, tables, parameters, delays."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import cast

import numpy as np

from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.files.user_text import shown
from host.sysid.models.state_space_model import DelayGroup, Parameter

_LARGE = "M_alpha of an indoor model at 10 m/s: -1000 1/s2"
_NUMBER = Quantity("", -1e6, 1e6, _LARGE)
_POSITIVE = Quantity("", 0.0, 1e6, _LARGE, above=True)


def names_from(document: Mapping[str, object], key: str, prefix: str) -> tuple[str, ...]:
    """Return a list of signal names.

    Parameters
    ----------
    document : mapping
    key : str
    prefix : str
        Begins an error message.

    Raises
    ------
    IdentificationError
        If it is none.
    """
    value = document.get(key)
    if not isinstance(value, list) or not all(isinstance(x, str) for x in value):
        raise IdentificationError(f"{prefix}{key} must be a list of signal names")
    return tuple(cast(list[str], value))


def table_from(value: object, allowed: Collection[str], where: str) -> dict[str, object]:
    """Return a table that has no other keys than those allowed.

    Raises
    ------
    IdentificationError
        If it is none, or has.
    """
    if not isinstance(value, dict):
        raise IdentificationError(
            f"{where}: {shown(value)}, expected a table of {', '.join(allowed)}"
        )
    unknown_keys = sorted(set(value) - set(allowed))
    if unknown_keys:
        raise IdentificationError(
            f"{where}: unknown key {', '.join(unknown_keys)}; known are {', '.join(allowed)}"
        )
    return value


def number_from(value: object, where: str, *, positive: bool = False) -> float:
    """Return a number of a model.

    Raises
    ------
    IdentificationError
        If it is none, or larger than any of a model.
    """
    return (_POSITIVE if positive else _NUMBER).check(where, value, IdentificationError)


def parameter_from(name: str, value: object, where: str) -> Parameter:
    """Return a parameter from its start value, or a table of start, bounds and prior.

    Raises
    ------
    IdentificationError
        If it is neither, or the start is not between the bounds.
    """
    if not isinstance(value, dict):
        return Parameter(name, number_from(value, where))
    settings = table_from(value, ("start", "lower", "upper", "prior_sd"), where)
    numbers = {
        k: number_from(v, f"{where}: {k}", positive=k == "prior_sd") for k, v in settings.items()
    }
    lower, upper = numbers.get("lower", -np.inf), numbers.get("upper", np.inf)
    if not lower < upper:
        raise IdentificationError(f"{where}: lower {lower:g} is not below upper {upper:g}")
    start = numbers.setdefault("start", min(max(0.0, lower), upper))
    if not lower <= start <= upper:
        raise IdentificationError(
            f"{where}: start {start:g} is not between lower {lower:g} and upper {upper:g}"
        )
    return Parameter(name=name, unit="", **numbers)


def delays_from(value: object, used: Collection[str], prefix: str) -> tuple[DelayGroup, ...]:
    """Return groups of delayed signals.

    Parameters
    ----------
    value : object
        A list of tables.
    used : collection of str
        Names that are taken.
    prefix : str
        Begins an error message.

    Raises
    ------
    IdentificationError
        If it is no such list, or a name or signal stands twice.
    """
    if not isinstance(value, list):
        raise IdentificationError(f"{prefix}[[delays]] must be a list of tables")
    result: list[DelayGroup] = []
    for item in value:
        table = table_from(item, ("name", "outputs", "prior_sd_s", "limit_s"), f"{prefix}a delay")
        name = table.get("name")
        if not isinstance(name, str):
            raise IdentificationError(f"{prefix}a delay needs name and outputs")
        where = f"{prefix}delay {name}"
        outputs = names_from(table, "outputs", f"{where}: ")
        if name in used or name in (d.name for d in result):
            raise IdentificationError(f"{where}: another parameter has this name")
        twice = [y for y in outputs if any(y in d.outputs for d in result)]
        if twice:
            raise IdentificationError(f"{where}: {twice[0]} has a delay already")
        numbers = {
            k: number_from(table[k], f"{where}: {k}", positive=True)
            for k in ("prior_sd_s", "limit_s")
            if k in table
        }
        result.append(DelayGroup(name, outputs, **numbers))
    return tuple(result)
