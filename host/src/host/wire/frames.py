"""Valid blocks -> frames: ids are walked in all blocks at once, each kind is copied out once."""

from __future__ import annotations

import itertools
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
from host.wire.schema import Schema, known_schemas, parse_schema

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


def find_schemas(path: Path, blocks: Blocks) -> dict[int, Schema]:
    """Return the schema of each hash that the log's blocks name.

    The log's own text comes first; a log whose copies are all damaged is read with the schema
    of that hash that some firmware was released with. A hash that stays unknown is absent.

    Parameters
    ----------
    path : Path
    blocks : Blocks
        The log's blocks in order.

    Returns
    -------
    dict of int to Schema
    """
    found: dict[int, Schema] = {}
    with path.open("rb", buffering=0) as file:
        for value in np.unique(blocks.schema_hash).tolist():
            pieces = np.flatnonzero((blocks.schema_hash == value) & (blocks.kind == KIND_SCHEMA))
            text = _schema_text(file, blocks, pieces)
            if text is None:
                text = known_schemas().get(value)
            if text is None:
                continue
            schema = parse_schema(text)
            if schema.hash == value:
                found[value] = schema
    return found


def _schema_text(file: FileIO, blocks: Blocks, pieces: NDArray[np.intp]) -> str | None:
    parts: dict[int, bytes] = {}
    for number in pieces:
        used = int(blocks.used[number])
        payload = read_at(file, int(blocks.position[number]) + HEADER_BYTES, used)
        try:
            piece = SCHEMA_PIECE.parse(payload)
        except StreamError:  # shorter than its own two numbers
            continue
        parts[piece.offset] = piece.text
        joined = _chain(parts, piece.total)
        if joined is not None:
            return joined.decode("ascii", errors="replace")
    return None


def _chain(parts: dict[int, bytes], total: int) -> bytes | None:
    text = b""
    while len(text) < total:
        piece = parts.get(len(text))
        if not piece:
            return None
        text += piece
    return text if len(text) == total else None


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
    usable = (blocks.kind == KIND_FRAMES) & (blocks.schema_hash == schema.hash)
    if span is not None:
        usable[: span[0]] = False
        usable[span[1] :] = False
    numbers = np.flatnonzero(usable)
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
