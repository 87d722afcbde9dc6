"""The committed table of what each number is, and how it follows the code."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.ideas.literals import Key

TABLE = Path(__file__).parent / "classes.tsv"
HEAD = ("file", "name", "value", "class", "source")
CLASSES = ("physics", "format", "numerical", "presentation", "tuned")
OPEN = "?"  # nobody has said yet
EVERY = "*"  # all numbers of a TOML file


@dataclass(frozen=True)
class Row:
    """What a number is.

    Attributes
    ----------
    kind : str
        One of `CLASSES`, or `OPEN`.
    source : str
        Book and page, paper, data sheet or row of a study that the number is from; empty where
        nobody named one.
    """

    kind: str
    source: str = ""


def read(table: Path = TABLE) -> dict[Key, Row]:
    """Return the table.

    Raises
    ------
    ValueError
        If a line has another number of columns or an unknown class.
    """
    rows = {}
    for number, line in enumerate(table.read_text(encoding="utf-8").splitlines()[1:], start=2):
        cells = line.split("\t")
        if len(cells) != len(HEAD) or cells[3] not in (*CLASSES, OPEN):
            raise ValueError(f"{table.name}, line {number}: {', '.join(HEAD)} are wanted: {line!r}")
        rows[Key(*cells[:3])] = Row(*cells[3:])
    return rows


def write(rows: Mapping[Key, Row], table: Path = TABLE) -> None:
    """Write the table, sorted by file, name and value."""
    lines = [HEAD, *((*_cells(key), row.kind, row.source) for key, row in sorted(rows.items()))]
    table.write_text("".join("\t".join(line) + "\n" for line in lines), encoding="utf-8")


def _cells(key: Key) -> tuple[str, str, str]:
    return key.file, key.name, key.value


def row_of(key: Key, rows: Mapping[Key, Row]) -> Row | None:
    """Return the row of a number: its own, else that of its whole file."""
    return rows.get(key) or rows.get(Key(key.file, EVERY, EVERY))


def missing(keys: Collection[Key], rows: Mapping[Key, Row]) -> list[Key]:
    """Return the numbers that have no class."""
    found = ((key, row_of(key, rows)) for key in keys)
    return sorted(key for key, row in found if row is None or row.kind == OPEN)


def stale(keys: Collection[Key], rows: Mapping[Key, Row]) -> list[Key]:
    """Return the rows whose number is gone."""
    files = {key.file for key in keys}
    there = set(keys) | {Key(file, EVERY, EVERY) for file in files}
    return sorted(set(rows) - there)


def follow(keys: Collection[Key], rows: Mapping[Key, Row]) -> dict[Key, Row]:
    """Return the table for the code as it is.

    A row whose number is gone goes to a new number of the same name and value, else of the same
    file and value, where all such rows say the same. What then has no row is open.
    """
    gone = stale(keys, rows)
    result = {key: row for key, row in rows.items() if key not in set(gone)}
    for key in sorted(set(keys)):
        if row_of(key, result) is None:
            result[key] = _carried(key, {one: rows[one] for one in gone})
    return result


def _carried(key: Key, gone: Mapping[Key, Row]) -> Row:
    # First the file has another name, or the function moved; then the function has another name.
    for part in ("name", "file"):
        found = {
            row
            for one, row in gone.items()
            if (getattr(one, part), one.value) == (getattr(key, part), key.value)
        }
        if len(found) == 1:
            return found.pop()
    return Row(OPEN)


def counted(keys: Collection[Key], rows: Mapping[Key, Row]) -> Counter[str]:
    """Return how many numbers each class has."""
    found = (row_of(key, rows) for key in keys)
    return Counter(row.kind if row else OPEN for row in found)
