"""The bytes of every frame a file holds, by `struct` and `json` alone: quick enough for campaigns.

Reads what protocol/README.md says, shares no line with the host package, and judges no schema: a
frame's length is all it takes from one.
"""

import json
import re
import struct
import zlib
from dataclasses import dataclass

from tests.protocol.log_writer import BLOCK, HEADER, MAGIC, ROOM

SIZES = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "f32": 4, "char": 1}


@dataclass(frozen=True, slots=True)
class Sealed:
    """A valid block: its place, file id, session, sequence, schema, kind and payload in use."""

    at: int
    file_id: int
    session: int
    sequence: int
    schema: int
    kind: int
    payload: bytes


def sealed_blocks(data: bytes) -> list[Sealed]:
    """Return every valid block: on the grid of 512 first, then at any byte of what is left."""
    grid = {at: one for at in range(0, len(data), BLOCK) if (one := _sealed(data, at)) is not None}
    found = []
    at = 0
    rising = sorted(grid)
    following = 0
    while at < len(data):
        while following < len(rising) and rising[following] < at:
            following += 1
        limit = rising[following] if following < len(rising) else len(data)
        if at == limit:
            found.append(grid[at])
            at += BLOCK
            continue
        begin = data.find(MAGIC, at, limit)
        if begin < 0 or begin + BLOCK > limit:
            at = limit
            continue
        one = _sealed(data, begin)
        if one is not None:
            found.append(one)
        at = begin + (BLOCK if one is not None else 1)
    return found


def log_rows(data: bytes, known: dict[int, bytes]) -> dict[int, dict[int, bytes]] | None:
    """Return the frames of the file's log as bytes: by hash of the schema, then by id of the frame.

    Parameters
    ----------
    data : bytes
    known : dict of int to bytes
        Schema texts from elsewhere, by their hash.

    Returns
    -------
    dict or None
        None if the file holds no valid block; a schema that cannot be had is left out.
    """
    blocks = sealed_blocks(data)
    if not blocks:
        return None
    own = [block for block in blocks if block.file_id == blocks[0].file_id]
    away = {block.at - BLOCK * block.sequence for block in own}
    places = sorted(place for place in away if place > 0)
    base = 0
    if 0 not in away and places:
        counts = [sum(b.at - BLOCK * b.sequence == place for b in own) for place in places]
        base = places[counts.index(max(counts))]
    chosen: dict[int, Sealed] = {}
    for block in own:
        held = chosen.get(block.sequence)
        if held is None or (
            block.at == base + BLOCK * block.sequence and held.at != base + BLOCK * held.sequence
        ):
            chosen[block.sequence] = block
    ordered = [chosen[sequence] for sequence in sorted(chosen)]
    texts = known | _texts(ordered)
    out: dict[int, dict[int, bytes]] = {}
    for schema in {block.schema for block in ordered}:
        lengths = _lengths(texts.get(schema))
        if lengths is None:
            continue
        frames: dict[int, list[bytes]] = {number: [] for number in lengths}
        for block in ordered:
            if block.schema == schema and block.kind == 0:
                _split(block.payload, lengths, frames)
        out[schema] = {number: b"".join(parts) for number, parts in frames.items()}
    return out


def _sealed(data: bytes, at: int) -> Sealed | None:
    if data[at : at + 4] != MAGIC or at + BLOCK > len(data):
        return None
    one = data[at : at + BLOCK]
    if zlib.crc32(one[:-4]) != int.from_bytes(one[-4:], "little"):
        return None
    _, file_id, session, sequence, schema, _, used, kind, _ = HEADER.unpack_from(one)
    if used > ROOM or kind > 1:
        return None
    return Sealed(at, file_id, session, sequence, schema, kind, one[28 : 28 + used])


def _split(payload: bytes, lengths: dict[int, int], frames: dict[int, list[bytes]]) -> None:
    at = 0
    while at < len(payload):
        length = lengths.get(payload[at], 0)
        if not length or at + length > len(payload):
            return
        frames[payload[at]].append(payload[at : at + length])
        at += length


def _texts(blocks: list[Sealed]) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    pieces: dict[tuple[int, int], dict[int, bytes]] = {}
    for block in blocks:
        if block.kind == 0 or len(block.payload) < 4:
            continue
        offset, total = struct.unpack_from("<HH", block.payload)
        parts = pieces.setdefault((block.schema, total), {})
        parts[offset] = block.payload[4:]
        text = b""
        while len(text) < total and parts.get(len(text)):
            text += parts[len(text)]
        if len(text) == total and zlib.crc32(text) == block.schema:
            found[block.schema] = text
    return found


def _lengths(text: bytes | None) -> dict[int, int] | None:
    """Return the length of each frame by its id; None for what is no schema."""
    try:
        raw = json.loads(text or b"")
        return {frame["id"]: 1 + sum(map(_size, frame["fields"])) for frame in raw["frames"]}
    except (ValueError, KeyError, TypeError, IndexError, RecursionError):
        return None


def _size(row: list[str]) -> int:
    base, count = re.fullmatch(r"(\w+?)(?:\[(\d+)\])?", row[1]).groups()  # type: ignore[union-attr]
    return SIZES[base] * int(count or 1)
