"""ArduPilot DataFlash: records of described kinds, in order of their time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.export.dataflash_layout import (
    FIELDS,
    FMT_BYTES,
    FMT_FIELDS,
    FMT_KIND,
    HEAD_BYTES,
    SYNC,
    record_type,
)

TIME = "TimeUS"
FIRST_KIND = 32  # of ours; ArduPilot's own numbers differ from release to release


@dataclass(frozen=True, slots=True)
class Records:
    """All records of one kind: its letters, and its fields by name, `TimeUS` among them.

    Numbers are in the unit that a reader gets: what a letter scales is scaled here.
    """

    name: str
    letters: str
    fields: Mapping[str, NDArray[Any] | Sequence[Any]]


def write_dataflash(path: Path, kinds: Sequence[Records]) -> None:
    """Write a log.

    Parameters
    ----------
    path : Path
    kinds : sequence of Records
        Those of one kind in order of time; kinds are merged by it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    numbers = {kind.name: FIRST_KIND + k for k, kind in enumerate(kinds)}
    head = [_described("FMT", FMT_KIND, FMT_BYTES, *FMT_FIELDS)]
    bodies: list[tuple[NDArray[np.int64], list[bytes]]] = []
    for kind in kinds:
        rows = _packed(kind)
        length = HEAD_BYTES + rows.dtype.itemsize
        head.append(
            _described(kind.name, numbers[kind.name], length, kind.letters, ",".join(kind.fields))
        )
        start = SYNC + bytes([numbers[kind.name]])
        size, whole = rows.dtype.itemsize, rows.tobytes()
        records = [start + whole[k * size : (k + 1) * size] for k in range(len(rows))]
        bodies.append((np.asarray(kind.fields[TIME], dtype=np.int64), records))
    times = np.concatenate([t for t, _ in bodies])
    every = [record for _, records in bodies for record in records]
    order = np.argsort(times, kind="stable")
    path.write_bytes(b"".join(head) + b"".join(every[k] for k in order.tolist()))


def _described(name: str, number: int, length: int, letters: str, columns: str) -> bytes:
    row = np.zeros(1, dtype=record_type(*FMT_FIELDS))
    row[0] = (number, length, name.encode(), letters.encode(), columns.encode())
    return SYNC + bytes([FMT_KIND]) + row.tobytes()


def _packed(kind: Records) -> NDArray[np.void]:
    """Return the bodies of all records."""
    rows = np.zeros(len(kind.fields[TIME]), record_type(kind.letters, ",".join(kind.fields)))
    for letter, (name, values) in zip(kind.letters, kind.fields.items(), strict=True):
        scale = FIELDS[letter][1]
        if scale in (0.0, 1.0):
            whole = rows.dtype[name].kind in "iu"
            rows[name] = np.round(values) if whole else values
        else:
            rows[name] = np.round(np.asarray(values) / scale)
    return rows
