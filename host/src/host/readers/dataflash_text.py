"""ArduPilot DataFlash as text (``.log``): a record a line, described by its FMT lines."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import IntArray
from host.export.dataflash_layout import FIELDS

_LONGEST_LINE = 1024


@dataclass(frozen=True, slots=True)
class TextRecords:
    """The fields of all records by kind, the line of each, how many lines were none, and which
    kinds are defined again and otherwise."""

    tables: dict[str, dict[str, NDArray[Any]]]
    lines: dict[str, IntArray]
    bad_lines: int
    twice: tuple[str, ...]


def read_text_records(path: Path, wanted: Collection[str]) -> TextRecords:
    """Read the records of the wanted kinds; numbers are already scaled in this form."""
    layouts: dict[str, tuple[str, list[str]]] = {}
    rows: dict[str, list[list[float | str]]] = {}
    places: dict[str, list[int]] = {}
    twice: dict[str, None] = {}
    bad = 0
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(iter(lambda: file.readline(_LONGEST_LINE), "")):
            parts = [part.strip() for part in line.rstrip("\r\n").split(",")]
            name = parts[0]
            if name == "FMT" and len(parts) > 5:
                # The first of two definitions counts: a script's rows are then no records.
                own = parts[4], parts[5:]
                if layouts.setdefault(parts[3], own) != own:
                    twice[parts[3]] = None
            elif name in wanted:
                row = _row(parts[1:], *layouts.get(name, ("", [])))
                bad += row is None
                if row is not None:
                    rows.setdefault(name, []).append(row)
                    places.setdefault(name, []).append(number)
            elif name and name not in layouts:
                bad += 1
    tables = {}
    for name, found in rows.items():
        _, columns = layouts[name]
        by_column = zip(*found, strict=True)
        tables[name] = {c: np.array(v) for c, v in zip(columns, by_column, strict=True)}
    lines = {name: np.array(every, dtype=np.int64) for name, every in places.items()}
    return TextRecords(tables, lines, bad, tuple(twice))


def _row(parts: list[str], letters: str, columns: list[str]) -> list[float | str] | None:
    """Return the fields of a line; None if it is cut or no number stands where one must."""
    if not columns or len(letters) != len(columns):
        return None
    if letters[-1] == "Z" and len(parts) > len(columns):  # a comma in the text of a message
        parts = [*parts[: len(columns) - 1], ", ".join(parts[len(columns) - 1 :])]
    if len(parts) != len(columns):
        return None
    try:
        return [
            text if FIELDS.get(letter, ("", 0.0))[1] == 0.0 else _number(letter, text)
            for letter, text in zip(letters, parts, strict=True)
        ]
    except ValueError:
        return None


def _number(letter: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        if letter == "M":  # a mode's name
            return float("nan")
        raise
