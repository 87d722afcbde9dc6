"""Text tables in their dialects: encoding, delimiter, decimal sign, where the names stand."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from host.errors import IdentificationError

if TYPE_CHECKING:
    import pandas as pd

HEAD_BYTES = 65536  # the dialect is recognised from these
HEAD_LINES = 60
DELIMITERS = ",;\t|"
SPACES = " "  # any run of blanks
COMMENT = "#"
MOST_SHORT = 0.05  # of the rows: more are no accident
_BEGINS_NUMBER = frozenset("0123456789+-.")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(e[+-]?\d+)?", re.IGNORECASE)
DECIMAL_POINT = re.compile(r"[+-]?\d*\.\d+(e[+-]?\d+)?", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a table is written: names are empty where it has none, `first` is the line after them."""

    delimiter: str
    first: int
    names: tuple[str, ...]
    width: int
    score: float


@dataclass(frozen=True, slots=True)
class Text:
    """A table as read, notes about it, and names that several of its columns have."""

    frame: pd.DataFrame
    notes: list[str]
    twice: frozenset[str]


def read_text(source: Path, head: bytes) -> Text:
    """Read a text table; columns without names are called by their numbers, from 1.

    Raises
    ------
    IdentificationError
        If it is no table, or holds no row.
    """
    import pandas as pd

    encoding = _encoding(source, head)
    lines = head.decode(encoding, errors="ignore").splitlines()
    if len(head) == HEAD_BYTES and len(lines) > 1:
        lines = lines[:-1]  # cut within
    dialect = _dialect(lines[:HEAD_LINES])
    if not any(_number(f) for line in lines[dialect.first :] for f in _split(line, dialect)):
        hint = "column names and no row below them" if dialect.names else "no line of numbers"
        raise IdentificationError(f"{source}: not a CSV table: {hint}")
    names, twice = _labels(dialect)
    notes: list[str] = []
    if not dialect.names:
        notes.append(f"no line of column names: columns are called 1 to {dialect.width}")
    elif dialect.first > 1:
        notes.append(f"the first {dialect.first - 1} lines hold no names and were left out")
    for attempt in (encoding, "cp1252", "latin-1"):
        try:
            strange = _strange_lines(source, attempt, dialect, notes)
            frame = pd.read_csv(
                source,
                sep=r"\s+" if dialect.delimiter == SPACES else dialect.delimiter,
                decimal=_decimal(lines[dialect.first :], dialect),
                encoding=attempt,
                header=None,
                names=names,
                skiprows=[*range(dialect.first), *strange],
                comment=COMMENT,
                skipinitialspace=True,
                index_col=False,
                low_memory=False,
                compression=None,  # whatever the ending says: what it expands to nobody asked
            )
        except UnicodeDecodeError:
            continue
        except (ValueError, OverflowError) as error:
            reason = str(error).strip().splitlines()[0]
            raise IdentificationError(f"{source}: not a CSV table: {reason}") from error
        return Text(frame, notes, frozenset(twice))
    raise IdentificationError(f"{source}: not a CSV table: no text of a known encoding")


def _strange_lines(source: Path, encoding: str, dialect: Dialect, notes: list[str]) -> list[int]:
    """Return the numbers, from 0, of lines that are no rows, and notes on how many there are.

    Two rows on one line, a row that is cut, names that stand there again: each costs itself alone.
    Where rows are short as a rule their last columns are missing, and they are kept.
    """
    others: dict[str, list[int]] = {"wide": [], "short": [], "names": []}
    rows = 0
    with source.open(encoding=encoding) as file:
        for number, line in enumerate(file):
            if number < dialect.first:
                continue
            if COMMENT in line:
                line = line.partition(COMMENT)[0]
            if not line.strip():
                continue
            rows += 1
            width = _width(line, dialect.delimiter)
            if width == dialect.width and line.strip()[:1] in _BEGINS_NUMBER:
                continue
            fields = _fields(line, dialect.delimiter)
            while len(fields) > dialect.width and not fields[-1]:
                fields.pop()  # the delimiter that ends every row
            if dialect.names and tuple(fields) == dialect.names:
                others["names"].append(number)
            elif len(fields) > dialect.width:
                others["wide"].append(number)
            elif len(fields) < dialect.width - 1:
                others["short"].append(number)
    if len(others["short"]) > MOST_SHORT * rows:
        notes.append(f"{len(others['short'])} of {rows} rows lack their last columns")
        others["short"] = []
    odd = sorted((*others["wide"], *others["short"]))
    if odd:
        notes.append(
            f"{len(odd)} of {rows} rows have another width than the {dialect.width} names and were"
            f" left out, the first in line {odd[0] + 1}"
        )
    if others["names"]:
        notes.append(
            f"the names stand there again in {len(others['names'])} lines, the first"
            f" {others['names'][0] + 1}: left out"
        )
    return sorted((*odd, *others["names"]))


def _width(line: str, delimiter: str) -> int:
    """Return how many fields a line has, quickly; 0 where quotes have to be looked at."""
    if delimiter == SPACES:
        return len(line.split())
    return 0 if '"' in line else line.count(delimiter) + 1


def _encoding(source: Path, head: bytes) -> str:
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in head:
        even, odd = head[0::2].count(0), head[1::2].count(0)
        if max(even, odd) > 0.3 * len(head) / 2 and min(even, odd) == 0:
            return "utf-16-le" if odd else "utf-16-be"
        raise IdentificationError(f"{source}: not a CSV table: the file is binary")
    return "utf-8-sig"


def _dialect(lines: list[str]) -> Dialect:
    """Return the way of writing that makes most lines equally wide."""
    best = Dialect(",", 0, (), 0, 0.0)
    # Blanks last, and only where nothing else separates: they stand within names too.
    for delimiter in (*DELIMITERS, SPACES):
        if delimiter == SPACES and best.width > 1:
            break
        found = _written(lines, delimiter)
        if found is not None:
            best = max(best, found, key=lambda d: (d.score, d.width))
    return best


def _written(lines: list[str], delimiter: str) -> Dialect | None:
    """Return how the lines look with one delimiter; None if it separates nothing."""
    split = [
        (number, _fields(line, delimiter))
        for number, line in enumerate(lines)
        if line.strip() and not line.startswith(COMMENT)
    ]
    widths = Counter(len(fields) for _, fields in split)
    if not widths:
        return None
    width, count = max(widths.items(), key=lambda w: (w[1] if w[0] > 1 else 0, w[0]))
    number, fields = next((n, f) for n, f in split if len(f) == width)
    score = count / len(split) if width > 1 else 0.0
    if not all(_number(f) for f in fields):
        return Dialect(delimiter, number + 1, tuple(fields), width, score)
    # Names may stand behind a comment sign, or lack the delimiter that ends every row.
    for at, line in reversed(list(enumerate(lines[:number]))):
        names = _fields(line.lstrip(COMMENT), delimiter)
        while len(names) > width and not names[-1]:
            names.pop()  # a comma behind the last name
        # Where most rows lack a slow sensor at their end, names are as wide as whole rows.
        whole = len(names) > width and widths[len(names)] > 1
        if (whole or len(names) in (width, width - 1)) and not any(_number(f) for f in names if f):
            first = at + 1 if whole else number
            return Dialect(delimiter, first, tuple(names), max(width, len(names)), score)
    return Dialect(delimiter, number, (), width, score)


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == SPACES:
        return line.split()
    return [f.strip() for f in next(csv.reader([line], delimiter=delimiter), [])]


def _split(line: str, dialect: Dialect) -> list[str]:
    return [f for f in _fields(line, dialect.delimiter) if f]


def _labels(dialect: Dialect) -> tuple[list[str], set[str]]:
    """Return a name of its own for every column, and those that stood there more than once."""
    written = [*dialect.names, *[""] * (dialect.width - len(dialect.names))]
    count: Counter[str] = Counter()
    labels = []
    for number, name in enumerate(written, start=1):
        count[name] += 1
        own = name or str(number)
        labels.append(own if count[name] == 1 or not name else f"{name} ({count[name]})")
    return labels, {name for name, times in count.items() if name and times > 1}


def _decimal(lines: list[str], dialect: Dialect) -> str:
    """Return the sign that more numbers are written with."""
    fields = [f for line in lines for f in _split(line, dialect)]
    commas = sum(DECIMAL_COMMA.fullmatch(f) is not None for f in fields)
    points = sum(DECIMAL_POINT.fullmatch(f) is not None for f in fields)
    return "," if commas > points else "."


def _number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return not text.strip()
    return True
