"""ArduPilot DataFlash .bin by numpy, from its own descriptions of records.

Records follow each other without a gap. A record counts only if it ends where another begins, or
the file: of damaged logs the record before the damage is left out with it, for nothing proves its
bytes. pymavlink hands it on (tests: oracle on whole logs).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import IntArray
from host.export.dataflash_layout import (
    FIELDS,
    FMT_BYTES,
    FMT_FIELDS,
    FMT_KIND,
    HEAD_BYTES,
    SYNC,
    record_type,
)

_CHUNK_BYTES = 64 << 20  # scanned at a time; bounds what a large log needs beside its records


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of record, as its FMT describes it."""

    name: str
    letters: str
    columns: str
    length: int


@dataclass(frozen=True, slots=True)
class BinaryRecords:
    """Where the records of a log are, and what of it is none.

    Attributes
    ----------
    kinds : dict of int to Kind
    places : dict of int to (m,) array
        Offsets of the proven records of each kind.
    lost : list of (offset, bytes)
        Ranges that hold no proven record.
    """

    data: NDArray[np.uint8]
    kinds: dict[int, Kind]
    places: dict[int, IntArray]
    lost: list[tuple[int, int]]

    def rows(self, number: int) -> dict[str, NDArray[Any]]:
        """Return the fields of all records of a kind, scaled as their letters say."""
        kind = self.kinds[number]
        layout = record_type(kind.letters, kind.columns)
        at = self.places[number]
        body = np.empty((len(at), layout.itemsize), dtype=np.uint8)
        step = max(1, _CHUNK_BYTES // max(layout.itemsize, 1) // 8)
        span = np.arange(HEAD_BYTES, HEAD_BYTES + layout.itemsize)
        for first in range(0, len(at), step):
            body[first : first + step] = self.data[at[first : first + step, None] + span]
        table = body.reshape(-1).view(layout)
        found: dict[str, NDArray[Any]] = {}
        for letter, name in zip(kind.letters, kind.columns.split(","), strict=True):
            scale = FIELDS[letter][1]
            values = table[name]
            found[name] = values * scale if scale not in (0.0, 1.0) else np.array(values)
        return found


def read_records(path: Path) -> BinaryRecords:
    """Find the records of a log."""
    data: NDArray[np.uint8] = np.zeros(0, dtype=np.uint8)
    if path.stat().st_size:
        data = np.asarray(np.memmap(path, dtype=np.uint8, mode="r"))
    starts = _sync_places(data)
    kinds = _described(data, starts)
    lengths = np.zeros(256, dtype=np.int64)
    for k, kind in kinds.items():
        lengths[k] = kind.length
    number = data[starts + 2] if len(starts) else np.zeros(0, dtype=np.uint8)
    known = lengths[number] > 0
    starts, number = starts[known], number[known]
    ends = starts + lengths[number]
    whole = ends <= len(data)
    starts, number, ends = starts[whole], number[whole], ends[whole]
    kept = _chained(starts, ends, len(data))
    starts, number, ends = starts[kept], number[kept], ends[kept]
    places = {k: starts[number == k] for k in kinds}
    return BinaryRecords(data, kinds, places, _gaps(starts, ends, len(data)))


def _sync_places(data: NDArray[np.uint8]) -> IntArray:
    found = []
    for first in range(0, max(len(data) - 2, 0), _CHUNK_BYTES):
        part = data[first : first + _CHUNK_BYTES + 2]
        two = (part[:-2] == SYNC[0]) & (part[1:-1] == SYNC[1])
        found.append(np.flatnonzero(two) + first)
    return np.concatenate(found) if found else np.zeros(0, dtype=np.int64)


def _described(data: NDArray[np.uint8], starts: IntArray) -> dict[int, Kind]:
    """Return the kinds that FMT records describe; one that nobody understands is left out."""
    layout = record_type(*FMT_FIELDS)
    found = {FMT_KIND: Kind("FMT", *FMT_FIELDS, FMT_BYTES)}
    for at in starts[data[starts + 2] == FMT_KIND].tolist() if len(starts) else []:
        raw = data[at + HEAD_BYTES : at + FMT_BYTES].tobytes()
        if len(raw) < layout.itemsize:
            continue
        number, length, name, letters, columns = np.frombuffer(raw, dtype=layout)[0].tolist()
        try:
            kind = Kind(name.decode("ascii"), letters.decode("ascii"), columns.decode("ascii"),
                        length)  # fmt: skip
            size = record_type(kind.letters, kind.columns).itemsize
        except (ValueError, UnicodeDecodeError):
            continue
        if size + HEAD_BYTES == length and kind.name.isalnum() and number not in found:
            found[number] = kind
    return found


def _chained(starts: IntArray, ends: IntArray, size: int) -> NDArray[np.bool_]:
    """Return which candidates are records: each ends where another begins, or the file.

    A pair of bytes inside a record that looks like a head is no record, for none ends there.
    """
    count = len(starts)
    kept = np.zeros(count, dtype=bool)
    if not count:
        return kept
    after = np.searchsorted(starts, ends)
    joined = np.zeros(count, dtype=bool)
    inside = after < count
    joined[inside] = starts[after[inside]] == ends[inside]
    joined |= ends == size
    # Runs in which each candidate is followed by the next one are walked as one.
    follows = joined & (after == np.arange(count) + 1)
    follows[-1] = False
    turns = np.flatnonzero(~follows)
    again = np.flatnonzero(joined)  # where the chain may be taken up after a break
    k = 0
    while k < count:
        if not joined[k]:
            nearest = np.searchsorted(again, k)
            if nearest == len(again):
                break
            k = int(again[nearest])
        last = int(turns[np.searchsorted(turns, k)])
        kept[k:last] = True
        if joined[last]:
            kept[last] = True
            k = int(after[last])
            if ends[last] == size:
                break
        else:
            k = last + 1
    return kept


def _gaps(starts: IntArray, ends: IntArray, size: int) -> list[tuple[int, int]]:
    """Return the ranges of the file between records, and behind the last."""
    edges = np.concatenate([[0], ends])
    begins = np.concatenate([starts, [size]])
    open_ = np.flatnonzero(begins > edges)
    return [(int(edges[k]), int(begins[k] - edges[k])) for k in open_.tolist()]
