"""The interface of all writers of tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import NDArray

Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Meta:
    """Metadata of a table, written where the format has a place for it.

    Parameters
    ----------
    units, texts : mapping of str to str
        Unit and meaning of each column.
    notes : mapping of str to str
        Source, calibration and the rest, as text.
    """

    units: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)


class TableWriter(Protocol):
    """Takes a table piece by piece."""

    def write(self, columns: Columns) -> None:
        """Append rows; the columns are the same each time."""

    def close(self) -> None:
        """Finish the file."""
