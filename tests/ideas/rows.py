"""Tables of numbers: a dataclass a row, its fields the columns, sorted by number."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TypeVar

from tests.ideas.literals import Key


@dataclass(frozen=True)
class NumberRow:
    """The number (`Key`) that a row says something of."""

    file: str
    name: str
    value: str

    @property
    def key(self) -> Key:
        """The number."""
        return Key(self.file, self.name, self.value)


R = TypeVar("R", bound=NumberRow)


def read_rows(kind: type[R], table: Path) -> dict[Key, R]:
    """Return the rows of a table; none where there is no table."""
    if not table.is_file():
        return {}
    types = [{"int": int, "float": float}.get(str(one.type), str) for one in fields(kind)]
    lines = (line.split("\t") for line in table.read_text(encoding="utf-8").splitlines()[1:])
    rows = (kind(*(of(cell) for of, cell in zip(types, line, strict=True))) for line in lines)
    return {row.key: row for row in rows}


def write_rows(kind: type[R], rows: Iterable[R], table: Path) -> None:
    """Write a table."""
    head = [one.name for one in fields(kind)]
    lines = [head, *(map(str, astuple(row)) for row in sorted(rows, key=lambda row: row.key))]
    table.write_text("".join("\t".join(line) + "\n" for line in lines), encoding="utf-8")
