"""An independent decoder of logs and telemetry, made with construct from protocol/README.md alone.

Slow and plain on purpose: one block, one frame, one byte after the other. It shares no code with
the host package, so that where both agree, both read the page the same way.
"""

import json
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import construct as c

MAGIC = b"FLT1"
BLOCK = 512
PAYLOAD = 480
SYNC = b"\xa5\x5a"
NUMBERS = {
    "u8": c.Int8ul,
    "i8": c.Int8sl,
    "u16": c.Int16ul,
    "i16": c.Int16sl,
    "u32": c.Int32ul,
    "i32": c.Int32sl,
    "f32": c.Float32l,
}

BLOCK_FORMAT = c.Struct(
    "body"
    / c.RawCopy(
        c.Struct(
            "magic" / c.Bytes(4),
            "file_id" / c.Int32ul,
            "session" / c.Int32ul,
            "sequence" / c.Int32ul,
            "schema_hash" / c.Int32ul,
            "dropped" / c.Int32ul,
            "used" / c.Int16ul,
            "kind" / c.Int8ul,
            "reserved" / c.Int8ul,
            "payload" / c.Bytes(PAYLOAD),
        )
    ),
    "crc" / c.Int32ul,
)
PIECE_FORMAT = c.Struct("offset" / c.Int16ul, "total" / c.Int16ul, "text" / c.GreedyBytes)
ENVELOPE_FORMAT = c.Struct(
    "sync" / c.Const(SYNC),
    "covered" / c.RawCopy(c.Prefixed(c.Int8ul, c.GreedyBytes)),
    "crc" / c.Int16ul,
)


@dataclass(frozen=True, slots=True)
class Block:
    """One block as it stands in the file; `verdict` is "ok" or the first check that failed."""

    position: int
    verdict: str
    file_id: int
    session: int
    sequence: int
    schema_hash: int
    dropped: int
    used: int
    kind: int
    payload: bytes


@dataclass(slots=True)
class Decoded:
    """What a log holds.

    Parameters
    ----------
    file_id : int
        Id of the log: that of the first valid block.
    frames : dict of str to list
        Every frame by name: its values by field and the sequence of its block.
    missing : list of (int, int)
        First and last sequence of each run of blocks that are not there, up to the last one.
    foreign : list of int
        Positions of valid blocks of other logs.
    unread : int
        Payload bytes that could not be read as frames.
    unreadable : int
        Blocks whose schema is not known.
    complete : str
        complete, truncated or damaged.
    """

    file_id: int
    frames: dict[str, list[tuple[Mapping[str, Any], int]]] = field(default_factory=dict)
    missing: list[tuple[int, int]] = field(default_factory=list)
    foreign: list[int] = field(default_factory=list)
    sessions: list[int] = field(default_factory=list)
    unread: int = 0
    unreadable: int = 0
    complete: str = "complete"


@dataclass(slots=True)
class Stream:
    """What a telemetry stream holds; counts as in README.md, "Cases"."""

    frames: list[bytes] = field(default_factory=list)
    failed: int = 0
    skipped: int = 0
    pending: int = 0


def parse_block(data: bytes, position: int = 0) -> Block:
    """Read one block of 512 bytes at `position` and judge it."""
    parsed = BLOCK_FORMAT.parse(data[position : position + BLOCK])
    head = parsed.body.value
    verdict = "ok"
    if head.magic != MAGIC:
        verdict = "magic"
    elif zlib.crc32(parsed.body.data) != parsed.crc:
        verdict = "crc"
    elif head.used > PAYLOAD:
        verdict = "used"
    elif head.kind not in (0, 1):
        verdict = "kind"
    return Block(
        position,
        verdict,
        head.file_id,
        head.session,
        head.sequence,
        head.schema_hash,
        head.dropped,
        head.used,
        head.kind,
        bytes(head.payload),
    )


def find_blocks(data: bytes) -> list[Block]:
    """Return every valid block of a file: on the grid, and off it where the grid fails."""
    on_grid = {
        at: parsed
        for at in range(0, len(data) - BLOCK + 1, BLOCK)
        if (parsed := parse_block(data, at)).verdict == "ok"
    }
    found = []
    at = 0
    while at + BLOCK <= len(data):
        block: Block | None = on_grid.get(at)
        if block is None and data[at : at + 4] == MAGIC:
            candidate = parse_block(data, at)
            covered = any(at < other < at + BLOCK for other in on_grid)
            block = candidate if candidate.verdict == "ok" and not covered else None
        if block is not None:
            found.append(block)
            at += BLOCK
            continue
        following = data.find(MAGIC, at + 1)
        grid = min((other for other in on_grid if other > at), default=len(data))
        at = min(following if following >= 0 else len(data), grid)
    return found


def decode(data: bytes, *, known_schemas: Sequence[bytes] = ()) -> Decoded | None:
    """Decode a whole log; None if it holds no valid block.

    Parameters
    ----------
    data : bytes
    known_schemas : sequence of bytes
        Schema texts from elsewhere, for logs that lost theirs.
    """
    valid = find_blocks(data)
    if not valid:
        return None
    result = Decoded(file_id=_own_id(data, valid))
    own = [block for block in valid if block.file_id == result.file_id]
    result.foreign = [block.position for block in valid if block.file_id != result.file_id]
    ordered = _one_per_sequence(own)
    schemas = {zlib.crc32(text): frame_formats(text) for text in known_schemas}
    schemas |= {key: frame_formats(text) for key, text in schema_texts(own).items()}
    expected = 0
    for block in ordered:
        if block.sequence > expected:
            result.missing.append((expected, block.sequence - 1))
        expected = block.sequence + 1
        if block.session not in result.sessions:
            result.sessions.append(block.session)
        if block.kind == 1:
            continue
        if block.schema_hash not in schemas:
            result.unreadable += 1
            continue
        frames, unread = read_frames(block.payload[: block.used], schemas[block.schema_hash])
        result.unread += unread
        for name, values in frames:
            result.frames.setdefault(name, []).append((values, block.sequence))
    result.complete = _completeness(data, valid, ordered, result)
    return result


def schema_texts(blocks: Sequence[Block]) -> dict[int, bytes]:
    """Return the whole schema texts that the blocks' pieces make, by their hash."""
    pieces: dict[tuple[int, int], dict[int, bytes]] = {}
    for block in blocks:
        if block.kind == 1 and block.used >= 4:
            piece = PIECE_FORMAT.parse(block.payload[: block.used])
            pieces.setdefault((block.schema_hash, piece.total), {})[piece.offset] = piece.text
    texts = {}
    for (schema_hash, total), parts in pieces.items():
        text = b""
        while len(text) < total and parts.get(len(text)):
            text += parts[len(text)]
        if len(text) == total and zlib.crc32(text) == schema_hash:
            texts[schema_hash] = text
    return texts


def frame_formats(text: bytes) -> dict[int, tuple[str, Any]]:
    """Return name and construct of every frame of a schema text, by id."""
    schema = json.loads(text)
    column = {name: number for number, name in enumerate(schema["columns"])}
    return {
        frame["id"]: (
            frame["name"],
            c.Struct(
                *(
                    row[column["name"]] / _field_format(row[column["type"]])
                    for row in frame["fields"]
                )
            ),
        )
        for frame in schema["frames"]
    }


def read_frames(
    payload: bytes, formats: Mapping[int, tuple[str, Any]]
) -> tuple[list[tuple[str, Mapping[str, Any]]], int]:
    """Read whole frames one after the other; return them and the bytes left unread."""
    frames = []
    at = 0
    while at < len(payload):
        if payload[at] not in formats:
            break
        name, layout = formats[payload[at]]
        size = layout.sizeof()
        if at + 1 + size > len(payload):
            break
        frames.append((name, layout.parse(payload[at + 1 : at + 1 + size])))
        at += 1 + size
    return frames, len(payload) - at


def decode_stream(data: bytes) -> Stream:
    """Find the frames of a telemetry stream that ends where `data` ends."""
    result = Stream()
    at = 0
    while at < len(data):
        rest = data[at:]
        if not SYNC.startswith(rest[:2]):
            result.skipped += 1
            at += 1
            continue
        if len(rest) >= 3 and not 1 <= rest[2] <= 128:
            result.failed += 1
            result.skipped += 1
            at += 1
            continue
        if len(rest) < 3 or len(rest) < rest[2] + 5:
            result.pending = len(rest)
            break
        parsed = ENVELOPE_FORMAT.parse(rest)
        if _crc16(parsed.covered.data) != parsed.crc:
            result.failed += 1
            result.skipped += 1
            at += 1
            continue
        result.frames.append(bytes(parsed.covered.value))
        at += len(parsed.covered.value) + 5
    return result


def _own_id(data: bytes, valid: Sequence[Block]) -> int:
    """Return the file id of the first block; in the image of a card that of the newest flight."""
    recorded = [block for block in valid if block.sequence]
    if data[510:512] != b"\x55\xaa" or data[:4] == MAGIC or not recorded:
        return valid[0].file_id
    newest = max(block.session for block in recorded)
    return next(block.file_id for block in recorded if block.session == newest)


def _base(own: Sequence[Block]) -> int:
    """Return the byte at which the log's block 0 belongs."""
    places = [block.position - BLOCK * block.sequence for block in own]
    ahead = Counter(place for place in places if place > 0)
    if 0 in places or not ahead:
        return 0
    most = max(ahead.values())
    return min(place for place, count in ahead.items() if count == most)


def _one_per_sequence(blocks: Sequence[Block]) -> list[Block]:
    chosen: dict[int, Block] = {}
    base = _base(blocks)
    for block in blocks:
        held = chosen.get(block.sequence)
        at_its_place = block.position == base + BLOCK * block.sequence
        if held is None or (at_its_place and held.position != base + BLOCK * held.sequence):
            chosen[block.sequence] = block
    return [chosen[sequence] for sequence in sorted(chosen)]


def _completeness(
    data: bytes, valid: Sequence[Block], ordered: Sequence[Block], result: Decoded
) -> str:
    last = ordered[-1]
    if result.missing or result.unread or result.unreadable:
        return "damaged"
    if any(
        values["code"] == 2
        for values, sequence in result.frames.get("event", [])
        if sequence == last.sequence
    ):
        return "complete"
    end = max(block.position for block in ordered) + BLOCK
    if all(block.position != end for block in valid) and _like_a_block(data, end, last):
        return "damaged"
    made = [values["preallocated"] for values, _ in result.frames.get("file", [])]
    base = _base([block for block in valid if block.file_id == result.file_id])
    full = base + ((made[-1] if made else 0) or 64 << 20)
    never_closed = end <= full and (len(data) == full or (base > 0 and full < len(data)))
    return "truncated" if never_closed else "damaged"


def _like_a_block(data: bytes, at: int, last: Block) -> bool:
    if at + BLOCK > len(data):
        return False
    head = c.Struct(
        "magic" / c.Bytes(4),
        "file_id" / c.Int32ul,
        "session" / c.Int32ul,
        "sequence" / c.Int32ul,
        "schema_hash" / c.Int32ul,
    ).parse(data[at : at + 20])
    alike = [head.magic == MAGIC, head.file_id == last.file_id]
    alike += [head.session == last.session, head.schema_hash == last.schema_hash]
    return alike.count(True) >= 2


def _field_format(kind: str) -> Any:
    base, _, length = kind.rstrip("]").partition("[")
    if base == "char":
        return c.Bytes(int(length or 1))
    return c.Array(int(length), NUMBERS[base]) if length else NUMBERS[base]


def _crc16(data: bytes) -> int:
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc <<= 1
            if crc & 0x10000:
                crc ^= 0x11021
    return crc
