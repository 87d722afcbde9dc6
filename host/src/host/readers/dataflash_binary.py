"""ArduPilot DataFlash .bin by numpy, from its own descriptions of records.

Records follow each other without a gap. A record counts only if it ends where another begins, or
the file. In a damaged log the record before the damage is left out too, for nothing proves its
bytes; pymavlink returns it. On whole logs tests compare with pymavlink.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
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

LARGEST_UINT32 = 1 << 32
_CHUNK_BYTES = 32 << 20  # read at a time: what a log needs besides the places of its records
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of record, as its FMT describes it."""

    name: str
    letters: str
    columns: str
    length: int


@dataclass(frozen=True, slots=True)
class BinaryRecords:
    """Places of a log's records, and ranges without any.

    Attributes
    ----------
    path : Path
    kinds : dict of int to Kind
    places : dict of int to (m,) array
        Offsets of the proven records of each kind.
    lost : list of (offset, bytes)
        Ranges that hold no proven record.
    """

    path: Path
    kinds: dict[int, Kind]
    places: dict[int, IntArray]
    lost: list[tuple[int, int]]

    def rows(
        self, kind: Kind, at: IntArray, wanted: Collection[str] = ()
    ) -> dict[str, NDArray[Any]]:
        """Return the wanted fields (all without) of the records of a kind at offsets `at` (m,),
        scaled as their letters say."""
        layout = record_type(kind.letters, kind.columns)
        span = np.arange(HEAD_BYTES, HEAD_BYTES + layout.itemsize)
        letters = {
            name: letter
            for letter, name in zip(kind.letters, kind.columns.split(","), strict=True)
            if not wanted or name in wanted
        }
        found = {name: np.empty((len(at), *layout[name].shape), layout[name].base)
                 for name in letters}  # fmt: skip
        for first, data in _chunks(self.path, kind.length):
            ends = np.array(
                [first, min(first + _CHUNK_BYTES, np.iinfo(at.dtype).max)], dtype=at.dtype
            )
            low, high = np.searchsorted(at, ends)
            if low == high:
                continue
            body = data[(at[low:high] - first)[:, None] + span]
            table = body.reshape(-1).view(layout)
            for name in letters:
                found[name][low:high] = table[name]
        for name, letter in letters.items():
            if (scale := FIELDS[letter][1]) not in (0.0, 1.0):
                found[name] = found[name] * scale
        return found


def read_records(path: Path, progress: Progress | None = None) -> BinaryRecords:
    """Find the records of a log.

    Parameters
    ----------
    path : Path
    progress : callable, optional
        Called with the bytes looked at, and those of the file.
    """
    size = path.stat().st_size
    starts, number = _sync_places(path, size, progress)
    kinds = _described(path, starts[number == FMT_KIND])
    lengths = np.zeros(256, dtype=np.uint8)
    for k, kind in kinds.items():
        lengths[k] = kind.length
    length = lengths[number]
    starts, number, length = _those(length > 0, starts, number, length)
    starts, number, length = _those(starts + length <= size, starts, number, length)
    starts, number, length = _those(_chained(starts, length, size), starts, number, length)
    lost = _gaps(starts, length, size)
    del length
    places = {k: starts[number == k] for k in kinds}
    return BinaryRecords(path, kinds, places, lost)


def _those(
    kept: NDArray[np.bool_], starts: IntArray, number: NDArray[np.uint8], length: NDArray[np.uint8]
) -> tuple[IntArray, NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the kept elements of three arrays, without a copy if all are kept."""
    if kept.all():
        return starts, number, length
    return starts[kept], number[kept], length[kept]


def _chunks(path: Path, beyond: int) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """Yield offset and bytes of each part of a file, with so many of the next one's."""
    with path.open("rb") as file:
        for first in range(0, path.stat().st_size, _CHUNK_BYTES):
            file.seek(first)
            yield first, np.frombuffer(file.read(_CHUNK_BYTES + beyond), dtype=np.uint8)


def _sync_places(
    path: Path, size: int, progress: Progress | None
) -> tuple[IntArray, NDArray[np.uint8]]:
    """Return where a record may begin, and the number of its kind."""
    # Half the memory where the file is shorter than the numbers reach.
    kind: Any = np.uint32 if size < LARGEST_UINT32 - 256 else np.int64
    places, numbers = [np.zeros(0, dtype=kind)], [np.zeros(0, dtype=np.uint8)]
    for first, part in _chunks(path, 2):
        if len(part) > 2:
            found = np.flatnonzero((part[:-2] == SYNC[0]) & (part[1:-1] == SYNC[1]))
            places.append((found + first).astype(kind))
            numbers.append(part[found + 2])
        if progress is not None:
            progress(min(first + _CHUNK_BYTES, size), size)
    return np.concatenate(places), np.concatenate(numbers)


def _described(path: Path, starts: IntArray) -> dict[int, Kind]:
    """Return the kinds that FMT records describe; one that nobody understands is left out."""
    layout = record_type(*FMT_FIELDS)
    found = {FMT_KIND: Kind("FMT", *FMT_FIELDS, FMT_BYTES)}
    with path.open("rb") as file:
        for at in starts.tolist():
            file.seek(at + HEAD_BYTES)
            raw = file.read(layout.itemsize)
            if len(raw) < layout.itemsize:
                continue
            number, length, name, letters, columns = np.frombuffer(raw, dtype=layout)[0].tolist()
            try:
                kind = Kind(
                    name.decode("ascii"), letters.decode("ascii"), columns.decode("ascii"), length
                )
                size = record_type(kind.letters, kind.columns).itemsize
            except (ValueError, UnicodeDecodeError):
                continue
            if size + HEAD_BYTES == length and kind.name.isalnum() and number not in found:
                found[number] = kind
    return found


def _chained(starts: IntArray, length: NDArray[np.uint8], size: int) -> NDArray[np.bool_]:
    """Return which candidates are records: each ends where another begins, or the file.

    A pair of bytes inside a record that looks like a head is no record, for none ends there.
    """
    count = len(starts)
    kept = np.zeros(count, dtype=bool)
    if not count:
        return kept
    # Nearly all are followed by the next candidate; only where one is not, others are looked at.
    contiguous = np.zeros(count, dtype=bool)
    for first in range(0, count - 1, _CHUNK_BYTES):
        end = min(first + _CHUNK_BYTES, count - 1)
        contiguous[first:end] = np.diff(starts[first : end + 1]) == length[first:end]
    turns = np.flatnonzero(~contiguous)
    ends = starts[turns] + length[turns]
    after = np.searchsorted(starts, ends)
    joined = ends == size
    inside = after < count
    joined[inside] |= starts[after[inside]] == ends[inside]
    k = 0
    while k < count:
        turn = int(np.searchsorted(turns, k))
        last = int(turns[turn])
        kept[k:last] = True
        if not joined[turn]:
            k = last + 1
            continue
        kept[last] = True
        k = int(after[turn])
    return kept


def _gaps(starts: IntArray, length: NDArray[np.uint8], size: int) -> list[tuple[int, int]]:
    """Return the ranges of the file between records, and behind the last."""
    if not len(starts):
        return [(0, size)] if size else []
    open_ = np.flatnonzero(np.diff(starts) != length[:-1])
    found = [(0, int(starts[0]))] if starts[0] else []
    found += [
        (at, int(starts[k + 1]) - at)
        for k in open_.tolist()
        if (at := int(starts[k]) + int(length[k])) < int(starts[k + 1])
    ]
    end = int(starts[-1]) + int(length[-1])
    return [*found, (end, size - end)] if end < size else found
