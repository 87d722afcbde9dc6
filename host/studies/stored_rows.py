"""Rows of a study in a file that a later run continues: what is there is not flown again."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

Row = Mapping[str, object]
Key = tuple[object, ...]


def flown_rows(
    path: Path,
    columns: Sequence[str],
    keys: Iterable[Key],
    fly: Callable[..., Iterable[Row]],
) -> list[dict[str, str]]:
    """Fly what the file has not yet, and return all its rows.

    Parameters
    ----------
    path : Path
        CSV file; made where there is none.
    columns : sequence of str
        Of a row; the first ones are the key.
    keys : iterable of tuple
        One of each flight, all of one length.
    fly : callable
        Given the entries of a key, its rows.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    rows, keys = _read(path), list(keys)
    known = {tuple(r[c] for c in columns[: len(key)]) for key in keys[:1] for r in rows}
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, columns, restval="")
        if file.tell() == 0:  # not where a run was stopped before its first flight
            writer.writeheader()
        for key in keys:
            if tuple(map(str, key)) not in known:
                writer.writerows(fly(*key))
                file.flush()
                print(f"\r{', '.join(map(str, key))}   ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return _read(path)


def _read(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
