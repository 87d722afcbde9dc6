"""Valid blocks -> frames: ids are walked in all blocks at once, each kind is copied out once."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
from construct import GreedyBytes, Int16ul, StreamError, Struct
from numpy.typing import NDArray

from host.errors import LogError
from host.wire.blocks import HEADER_BYTES, KIND_FRAMES, KIND_SCHEMA, Blocks, read_at
from host.wire.extents import BLOCK_BYTES
from host.wire.schema import Schema
from host.wire.schema_text import known_schemas, parse_schema

BLOCKS_AT_ONCE = 4096  # 2 MiB: frames and columns of one piece stay in the cache
SCHEMA_PIECE = Struct("offset" / Int16ul, "total" / Int16ul, "text" / GreedyBytes)


@dataclass(frozen=True, slots=True)
class FrameSet:
    """Frames of one kind in the order of the log.

    Parameters
    ----------
    data : NDArray, shape (n,)
        Structured, packed, raw, with the frame's id in field ``id``.
    block : NDArray[np.int32], shape (n,)
        Which of the log's blocks each frame stood in.
    """

    data: NDArray[Any]
    block: NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Piece:
    """The frames of some consecutive blocks.

    Parameters
    ----------
    frames : dict of str to FrameSet
    done : int
        Number of the block behind the last one read.
    unread_bytes : int
        Payload bytes behind an id the schema does not have, or behind a frame cut by `used`.
    """

    frames: dict[str, FrameSet]
    done: int
    unread_bytes: int


def find_schemas(path: Path, blocks: Blocks) -> Iterator[tuple[int, Schema | LogError]]:
    """Yield the schema of each hash that the log's blocks name, the most used first.

    The log's own text comes first; a log whose copies are all damaged is read with a
    released schema of the same hash. A hash that stays unknown is left out; one whose text is no
    schema comes with the reason.

    Parameters
    ----------
    path : Path
    blocks : Blocks
        The log's blocks in order.

    Yields
    ------
    (int, Schema or LogError)
    """
    values, which, counts = np.unique(blocks.schema_hash, return_inverse=True, return_counts=True)
    pieces = np.flatnonzero(blocks.kind == KIND_SCHEMA)
    pieces = pieces[np.argsort(which[pieces], kind="stable")]
    bounds = np.searchsorted(which[pieces], np.arange(len(values) + 1))
    with path.open("rb", buffering=0) as file:
        for at in np.argsort(-counts, kind="stable").tolist():
            value = int(values[at])
            text = _schema_text(file, blocks, value, pieces[bounds[at] : bounds[at + 1]])
            if text is None:
                text = known_schemas().get(value)
            if text is None:
                continue
            try:
                yield value, parse_schema(text)
            except LogError as error:
                yield value, error


def _schema_text(
    file: FileIO, blocks: Blocks, value: int, pieces: NDArray[np.intp]
) -> bytes | None:
    """Return the text whose CRC-32 is `value`, put together from the pieces in their order."""
    texts: dict[int, _Growing] = {}
    for number in pieces.tolist():
        used = int(blocks.used[number])
        payload = read_at(file, int(blocks.position[number]) + HEADER_BYTES, used)
        try:
            piece = SCHEMA_PIECE.parse(payload)
        except StreamError:  # shorter than its own two numbers
            continue
        whole = texts.setdefault(piece.total, _Growing()).add(piece.offset, piece.text, piece.total)
        if whole is not None and zlib.crc32(whole) == value:
            return whole
    return None


class _Growing:
    """Joins pieces of a text that come in any order; each is touched once."""

    def __init__(self) -> None:
        self._text = bytearray()
        self._waiting: dict[int, bytes] = {}

    def add(self, offset: int, text: bytes, total: int) -> bytes | None:
        """Take a piece; return the text when it is whole, and begin anew."""
        if offset >= len(self._text) and text:
            self._waiting[offset] = text
        while len(self._text) < total and (piece := self._waiting.pop(len(self._text), None)):
            self._text += piece
        if len(self._text) < total:
            return None
        whole = bytes(self._text)
        self._text.clear()
        self._waiting.clear()
        return whole if len(whole) == total else None


def frame_pieces(
    path: Path,
    blocks: Blocks,
    schema: Schema,
    names: Collection[str],
    span: tuple[int, int] | None = None,
) -> Iterator[Piece]:
    """Yield the frames of a log 2 MiB at a time.

    Parameters
    ----------
    path : Path
    blocks : Blocks
        The log's blocks in order; those of another schema are left out.
    schema : Schema
    names : collection of str
        Kinds of frames wanted.
    span : (int, int), optional
        First and last + 1 block; all without it.

    Yields
    ------
    Piece

    Raises
    ------
    LogError
        If the schema has no such frame.
    """
    unknown = set(names) - set(schema.by_name)
    if unknown:
        raise LogError(f"this log has no frames called {', '.join(sorted(unknown))}")
    first, last = span or (0, len(blocks))
    usable = blocks.kind[first:last] == KIND_FRAMES
    usable &= blocks.schema_hash[first:last] == schema.hash
    numbers = first + np.flatnonzero(usable)
    memory = bytearray(min(BLOCKS_AT_ONCE, len(numbers)) * BLOCK_BYTES)
    with path.open("rb", buffering=0) as file:
        for start in range(0, len(numbers), BLOCKS_AT_ONCE):
            chosen = numbers[start : start + BLOCKS_AT_ONCE]
            buffer = _read_blocks(file, blocks.position[chosen], memory)
            places, ids, unread = _walk(buffer, blocks.used[chosen], schema)
            frames = {name: _gather(buffer, places, ids, schema, name, chosen) for name in names}
            yield Piece(frames, int(chosen[-1]) + 1, unread)


def _read_blocks(file: FileIO, position: NDArray[np.int64], memory: bytearray) -> memoryview:
    breaks = np.flatnonzero(np.diff(position) != BLOCK_BYTES) + 1
    edges = [0, *breaks.tolist(), len(position)]
    view = memoryview(memory)[: len(position) * BLOCK_BYTES]
    for first, last in itertools.pairwise(edges):
        part = view[first * BLOCK_BYTES : last * BLOCK_BYTES]
        got = read_at(file, int(position[first]), len(part), part)
        if len(got) < len(part):
            raise OSError(5, "the file became shorter while it was read")
    return view


def _walk(
    buffer: memoryview, used: NDArray[np.uint16], schema: Schema
) -> tuple[NDArray[np.int64], NDArray[np.uint8], int]:
    """Return where frames start, their ids (both in log order) and the bytes not understood."""
    raw = np.frombuffer(buffer, np.uint8)
    length_of = np.zeros(256, np.int64)
    for frame in schema.frames:
        length_of[frame.id] = frame.size_bytes
    at = np.arange(len(used), dtype=np.int64) * BLOCK_BYTES + HEADER_BYTES
    end = at + used
    places: list[NDArray[np.int64]] = []
    unread = 0
    open_ = at < end
    while open_.any():
        at, end = at[open_], end[open_]
        length = length_of[raw[at]]
        good = (length > 0) & (at + length <= end)
        if not good.all():
            unread += int((end - at)[~good].sum())
            at, end, length = at[good], end[good], length[good]
        places.append(at)
        at = at + length
        open_ = at < end
    place = np.concatenate(places) if places else np.empty(0, np.int64)
    place.sort()
    return place, raw[place], unread


def _gather(
    buffer: memoryview,
    places: NDArray[np.int64],
    ids: NDArray[np.uint8],
    schema: Schema,
    name: str,
    chosen: NDArray[np.intp],
) -> FrameSet:
    frame = schema.by_name[name]
    where = places[ids == frame.id]
    size = frame.size_bytes
    # Every byte of the buffer seen as the start of a frame: one copy per frame, no index per byte.
    starts = np.ndarray((len(buffer) - size + 1,), np.dtype(f"V{size}"), buffer, strides=(1,))
    return FrameSet(starts[where].view(frame.dtype), chosen[where // BLOCK_BYTES].astype(np.int32))


def join(schema: Schema, name: str, parts: Iterable[FrameSet], most: int = 0) -> FrameSet:
    """Return the frames of several pieces as one set.

    Parameters
    ----------
    schema : Schema
    name : str
    parts : iterable of FrameSet
        Consumed one by one.
    most : int
        Upper bound of their number, if it is known: each part is then copied while it is still in
        the cache. Memory that is not filled is never touched.
    """
    layout = schema.by_name[name].dtype
    # As plain bytes: numpy copies structured arrays field by field, five times slower.
    plain = np.dtype(f"V{layout.itemsize}")
    if not most:
        held = list(parts)
        if len(held) == 1:
            return held[0]
        if not held:
            return FrameSet(np.empty(0, layout), np.empty(0, np.int32))
        return FrameSet(
            np.concatenate([part.data.view(plain) for part in held]).view(layout),
            np.concatenate([part.block for part in held]),
        )
    data, block, count = np.empty(most, plain), np.empty(most, np.int32), 0
    for part in parts:
        end = count + len(part.data)
        data[count:end] = part.data.view(plain)
        block[count:end] = part.block
        count = end
    return FrameSet(data[:count].view(layout), block[:count])
