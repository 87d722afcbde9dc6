"""The record that goes with columns: what was done to which of them, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array


@dataclass(frozen=True, slots=True)
class ColumnChange:
    """Record of what was done to some columns, and why.

    Attributes
    ----------
    columns : tuple of str
    what, why : str
    remark : str
        What an answer says of it; most changes say nothing.
    """

    columns: tuple[str, ...]
    what: str
    why: str
    remark: str = ""


Record = tuple[ColumnChange, ...]


def changed_columns(before: Mapping[str, Array], after: Mapping[str, Array]) -> tuple[str, ...]:
    """Return the columns that are new or other than before."""
    return tuple(
        name
        for name, values in after.items()
        if values is not before.get(name)
        and not (name in before and np.array_equal(values, before[name], equal_nan=True))
    )


def change_of(
    before: Mapping[str, Array], after: Mapping[str, Array], what: str, why: str
) -> Record:
    """Return what was done from one set of columns to another; nothing where all are the same."""
    columns = changed_columns(before, after)
    return (ColumnChange(columns, what, why),) if columns else ()
