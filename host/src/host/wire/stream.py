"""Turn a captured telemetry stream into frames, in the order of arrival.

Each good envelope becomes a block of one frame, so that clock, sessions and table work as for a
log of blocks. File ids, which a stream lacks, are zero, and sequence numbers are counted.
"""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.errors import LogError
from host.wire.blocks import MAGIC, Blocks, Progress
from host.wire.frames import FrameSet, Piece
from host.wire.framing import (
    HEAD_BYTES,
    LONGEST_FRAME,
    SCHEMA_HASH_ID,
    TAIL_BYTES,
    find_envelopes,
    is_text,
    is_text_cut_short,
)
from host.wire.schema import Schema
from host.wire.schema_text import known_schemas, parse_schema
from host.wire.store import FrameStore

_ENVELOPE = HEAD_BYTES + TAIL_BYTES
_HASH_BYTES = 5
_FEWEST = 3  # envelopes: noise makes one in 65536 syncs, never three in a row
_REMEMBERED = 8  # frames of a kind among which a repeated one is looked for
_ASTRAY_US = 60_000_000  # a clock that jumps so far for one frame is a wrong frame
_BACK_US = -1_000_000  # a clock that steps back further was reset; frames finish 5 ms out of order
_WINDOW_BYTES = 1 << 20
_AT_ONCE = 1 << 15
LARGEST_BYTES = 1 << 30  # 4 days of the fastest radio; held in memory, eight times over


@dataclass(frozen=True, slots=True)
class Stream:
    """A captured stream.

    Parameters
    ----------
    data : bytes
        As received.
    blocks : Blocks
        One per frame that is used, in the order of arrival: `position` is that of its envelope,
        `used` the length of the frame, `session` a number for each run of the Mega's clock.
    bad : list of (int, int)
        Byte ranges in no good envelope; not the beginning of an envelope at the end, nor the
        status lines that USB has between envelopes.
    failed : int
        Syncs followed by a bad length or a wrong CRC.
    repeated : NDArray[np.int64]
        Places of envelopes that arrived before, byte for byte.
    unfit : NDArray[np.int64]
        Places of envelopes whose length does not fit their id, or whose clock is astray.
    schemas : dict of int to int
        Hash of each schema the stream names and how many of its frames follow it.
    """

    data: bytes
    blocks: Blocks
    bad: list[tuple[int, int]]
    failed: int
    repeated: NDArray[np.int64]
    unfit: NDArray[np.int64]
    schemas: dict[int, int]


def looks_like_stream(head: bytes) -> bool:
    """Tell whether a file that begins so is a captured telemetry stream.

    The head of a log of blocks is none, though a frame in it may hold what looks like envelopes.
    """
    return not head.startswith(MAGIC) and len(find_envelopes(head).places) >= _FEWEST


def read_stream(path: Path, *, texts: Collection[bytes] = (), limit_bytes: int = -1) -> Stream:
    """Find the frames of a captured stream.

    Frames before the first hash of a schema are of that schema too.

    Parameters
    ----------
    path : Path
    texts : collection of bytes
        Schemas known besides the released ones, such as that of a capture's head.
    limit_bytes : int
        Look at the head of the file only.

    Raises
    ------
    LogError
        If the file is too large, or none of its schemas is known.
    """
    if path.stat().st_size > LARGEST_BYTES and limit_bytes < 0:
        raise LogError(
            f"{path}: {path.stat().st_size} bytes of telemetry, expected at most {LARGEST_BYTES};"
            " cut it into pieces: envelopes are found in any"
        )
    with path.open("rb") as file:
        data = file.read(limit_bytes)
    place, failed = _envelopes(data, ended=limit_bytes < 0)
    octets = np.frombuffer(data, np.uint8)
    length = octets[place + 2]
    kind = octets[place + HEAD_BYTES]
    hashes = _hashes(data, place, length, kind)
    # Without a schema hash, which comes every 5 s, the schema is that of the capture's head.
    first_hash = zlib.crc32(next(iter(texts))) if texts else 0
    which = _schema_of(hashes, len(place), first_hash)
    known = _known(path, which, texts)
    fits = np.zeros(len(place), bool)
    for number, schema in known.items():
        size_of = np.zeros(256, np.int64)
        for frame in schema.frames:
            size_of[frame.id] = frame.size_bytes
        fits |= (which == number) & (size_of[kind] == length) & (length >= _HASH_BYTES)
    again = _repeated(data, place, length, kind, fits)
    t_us = _u32(data, place + HEAD_BYTES + 1, fits)
    use = fits & ~again
    astray = _astray(t_us, use)
    use &= ~astray
    at = np.flatnonzero(use)
    blocks = _blocks(place[at], which[at], length[at], kind[at], t_us[at])
    blocks = replace(blocks, session=_sessions(data, blocks, known))
    numbers, counts = np.unique(which, return_counts=True)
    return Stream(
        data=data,
        blocks=blocks,
        bad=[
            (a, b)
            for a, b in _bad(place, length, len(data))
            if not is_text(data[a:b]) and not (b == len(data) and is_text_cut_short(data[a:b]))
        ],
        failed=failed,
        repeated=place[again],
        unfit=place[(~fits & (kind != SCHEMA_HASH_ID)) | astray],
        schemas=dict(zip(numbers.tolist(), counts.tolist(), strict=True)),
    )


def _envelopes(data: bytes, *, ended: bool) -> tuple[NDArray[np.int64], int]:
    """Return where good envelopes begin, and how many failed; a window of the stream at a time."""
    places, failed, start = [], 0, 0
    while True:
        last = start + _WINDOW_BYTES >= len(data)
        found = find_envelopes(data[start : start + _WINDOW_BYTES], ended=ended and last)
        places.append(np.array(found.places, np.int64) + start)
        failed += found.failed
        if last:
            return np.concatenate(places), failed
        start += found.pending_from


def _blocks(
    place: NDArray[np.int64],
    which: NDArray[np.uint32],
    length: NDArray[np.uint8],
    kind: NDArray[np.uint8],
    t_us: NDArray[np.uint32],
) -> Blocks:
    """Return a block for each frame; what a stream does not have is zero."""
    none = np.zeros(len(place), np.uint32)
    return Blocks(
        position=place,
        file_id=none,
        session=none,
        sequence=np.arange(len(place), dtype=np.uint32),
        schema_hash=which,
        dropped=none,
        used=length.astype(np.uint16),
        kind=np.zeros(len(place), np.uint8),
        first_id=kind,
        first_t_us=t_us,
    )


class StreamStore(FrameStore):
    """Frames of a captured stream by name, held in memory.

    Parameters
    ----------
    path : Path
    stream : Stream
    blocks : Blocks
        Those of its frames that are wanted.
    schema : Schema
    progress : callable, optional
        Called with frames done and frames in all.
    """

    def __init__(
        self,
        path: Path,
        stream: Stream,
        blocks: Blocks,
        schema: Schema,
        progress: Progress | None = None,
    ) -> None:
        super().__init__(path, blocks, schema, progress)
        self._data = stream.data

    @property
    def in_memory(self) -> bool:
        """Always True: the stream is held in memory."""
        return True

    def _pieces(self, names: Collection[str], span: tuple[int, int] | None) -> Iterator[Piece]:
        first, last = span or (0, len(self.blocks))
        ids = self.blocks.first_id[first:last].copy()
        ids[self.blocks.schema_hash[first:last] != self.schema.hash] = SCHEMA_HASH_ID
        frames = {}
        for name in names:
            frame = self.schema.by_name[name]
            which = first + np.flatnonzero(ids == frame.id)
            places = self.blocks.position[which] + HEAD_BYTES
            raw = _anywhere(self._data, f"V{frame.size_bytes}")[places]
            frames[name] = FrameSet(raw.view(frame.dtype), which.astype(np.int32))
        yield Piece(frames, last, 0)


def stream_schemas(path: Path, stream: Stream, texts: Collection[bytes] = ()) -> list[Schema]:
    """Return the schemas of a stream that are known, the most used first; raises LogError."""
    known = _known(path, np.array(list(stream.schemas), np.uint32), texts)
    return sorted(known.values(), key=lambda schema: -stream.schemas[schema.hash])


def _hashes(
    data: bytes, place: NDArray[np.int64], length: NDArray[np.uint8], kind: NDArray[np.uint8]
) -> list[tuple[int, int]]:
    """Return envelope number and value of each hash of a schema."""
    rows = np.flatnonzero((kind == SCHEMA_HASH_ID) & (length == _HASH_BYTES)).tolist()
    starts = (place[rows] + HEAD_BYTES + 1).tolist()
    return [
        (number, int.from_bytes(data[start : start + 4], "little"))
        for number, start in zip(rows, starts, strict=True)
    ]


def _schema_of(hashes: list[tuple[int, int]], count: int, first_hash: int) -> NDArray[np.uint32]:
    """Return the schema hash of each of `count` envelopes; `first_hash` where there is none."""
    which = np.full(count, first_hash, np.uint32)
    for at, (number, value) in enumerate(hashes):
        which[number if at else 0 :] = value
    return which


def _known(path: Path, which: NDArray[np.uint32], texts: Collection[bytes]) -> dict[int, Schema]:
    """Return the schemas of these hashes that are known; raises LogError if there is none."""
    every = known_schemas() | {zlib.crc32(text): text for text in texts}
    asked = [int(value) for value in np.unique(which)]
    found = {value: parse_schema(every[value]) for value in asked if value in every}
    if not found and asked == [0]:
        raise LogError(
            f"{path}: {len(which)} telemetry frames and no hash of their schema, which the logger"
            " sends every 5 s; record longer"
        )
    if not found:
        names = ", ".join(f"{value:08x}" for value in asked)
        raise LogError(
            f"{path}: telemetry of schema {names}, which this program does not know; install the"
            " host tool of that firmware (the file keeps every byte)"
        )
    return found


def _anywhere(data: bytes, kind: str) -> NDArray[Any]:
    """Return every byte of the stream seen as the start of a value: one copy of what is taken."""
    room = max(0, len(data) - np.dtype(kind).itemsize + 1)
    return np.ndarray((room,), np.dtype(kind), data, strides=(1,))


def _u32(data: bytes, start: NDArray[np.int64], fits: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Return the little-endian number at each start; 0 where there is no frame."""
    out = np.zeros(len(start), np.uint32)
    out[fits] = _anywhere(data, "<u4")[start[fits]]
    return out


def _repeated(
    data: bytes,
    place: NDArray[np.int64],
    length: NDArray[np.uint8],
    kind: NDArray[np.uint8],
    fits: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return which frames arrived before: every frame carries its time, so none comes twice."""
    again = np.zeros(len(place), bool)
    last: dict[int, deque[bytes]] = {}
    used = np.flatnonzero(fits)
    for first in range(0, len(used), _AT_ONCE):
        part = used[first : first + _AT_ONCE]
        rows = zip(
            part.tolist(), place[part].tolist(), length[part].tolist(), kind[part].tolist(),
            strict=True,
        )  # fmt: skip
        for number, at, size, which in rows:
            frame = data[at + HEAD_BYTES : at + HEAD_BYTES + size]
            recent = last.setdefault(which, deque(maxlen=_REMEMBERED))
            if frame in recent:
                again[number] = True
            else:
                recent.append(frame)
    return again


def _astray(t_us: NDArray[np.uint32], use: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return frames whose clock is far from that of both neighbours, which agree: noise."""
    out = np.zeros(len(t_us), bool)
    at = np.flatnonzero(use)
    if len(at) < 3:
        return out
    t = t_us[at].astype(np.int64)
    step = np.abs(np.diff(t).astype(np.uint32).astype(np.int32).astype(np.int64))
    over = np.abs((t[2:] - t[:-2]).astype(np.uint32).astype(np.int32).astype(np.int64))
    wrong = (step[:-1] > _ASTRAY_US) & (step[1:] > _ASTRAY_US) & (over < _ASTRAY_US)
    out[at[1:-1][wrong]] = True
    return out


def _sessions(data: bytes, blocks: Blocks, known: dict[int, Schema]) -> NDArray[np.uint32]:
    """Number the runs of the Mega's clock: a reset sets it back to zero.

    The number is that of the frames `identity` in the run; where they are missing, or name that of
    the run before, the next higher one.
    """
    if not len(blocks):
        return np.empty(0, np.uint32)
    t_us = blocks.first_t_us.astype(np.int64)
    step = np.diff(t_us).astype(np.uint32).astype(np.int32)
    run = np.r_[0, np.cumsum(step < _BACK_US)]
    said = np.zeros(int(run[-1]) + 1, np.int64)
    for schema in known.values():
        frame = schema.by_name.get("identity")
        if frame is None or "session" not in (frame.dtype.names or ()):
            continue
        for at in np.flatnonzero(blocks.first_id == frame.id).tolist():
            start = int(blocks.position[at]) + HEAD_BYTES
            row = np.frombuffer(data, frame.dtype, 1, start)
            said[run[at]] = int(row["session"][0])
    number, numbers = 0, np.zeros(len(said), np.uint32)
    for at, value in enumerate(said.tolist()):
        number = value if value > number else number + 1
        numbers[at] = number & 0xFFFFFFFF
    return numbers[run]


def _bad(place: NDArray[np.int64], length: NDArray[np.uint8], size: int) -> list[tuple[int, int]]:
    """Return the ranges between envelopes; what is cut at either end is none."""
    if not len(place):
        return []
    # A capture may begin and end in the middle of an envelope.
    longest = _ENVELOPE + LONGEST_FRAME
    bad = [(0, int(place[0]))] if place[0] >= longest else []
    room = np.diff(place)
    room -= length[:-1]
    for at in np.flatnonzero(room > _ENVELOPE).tolist():
        end = int(place[at]) + int(length[at]) + _ENVELOPE
        bad.append((end, int(place[at + 1])))
    end = int(place[-1]) + int(length[-1]) + _ENVELOPE
    return [*bad, (end, size)] if size - end >= longest else bad
