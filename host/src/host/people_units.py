"""Units in what people read: degrees, where files and programs have radians."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from host.arrays import Array
from host.constants import DEG_PER_RAD

_ENDINGS = {"_radps": "_degps", "_rad": "_deg"}
_DEGREES = {"rad": "deg", "rad/s": "deg/s", "rad/s2": "deg/s2"}


def people_unit(unit: str) -> tuple[str, float]:
    """Return the unit a person reads, and the factor from the other one."""
    return (_DEGREES[unit], DEG_PER_RAD) if unit in _DEGREES else (unit, 1.0)


def people_name(name: str) -> tuple[str, float]:
    """Return a name that ends in its unit as a person reads it, and the factor: `q_degps`."""
    for ending, degrees in _ENDINGS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending)}{degrees}", DEG_PER_RAD
    return name, 1.0


def people_columns(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return columns as a person reads them, by name and by value."""
    found = {}
    for name, values in columns.items():
        called, factor = people_name(name)
        found[called] = values if factor == 1.0 else np.asarray(values, np.float64) * factor
    return found
