"""Forged logs: their content is wrong, but every CRC is right.

A forgery is a function of a log's bytes and of a seeded generator, as a damage is (damage.py). It
changes headers, frames or the schema; blocks are sealed again, and name the schema they then have.
"""

import json
import struct
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from tests.protocol.log_writer import BLOCK, ROOM, SCHEMA_ROOM, block

Forgery = Callable[[bytes, np.random.Generator], bytes]

NAMES = (
    *("../escape", "/tmp/escape", "..\\escape", "C:escape", "con", "aux", "a/b", ".", "..", ""),
    *("=1+1", "@x", "\x1b[31m", "a\nb", "a" * 33, "a" * 4000, "\u202eabc", "id", "t_us", "ident"),
    *("A", "_a", "1a", "a b", "a,b", "nul.txt", "valid", "count", "-rf", "a\0b", "p", "lpt1"),
)
NUMBERS: tuple[Any, ...] = (
    *(0, 1, -1, 7, 8, 15, 16, 31, 32, 127, 128, 255, 256, 65535, 65536, 2**31, 2**32, 2**63),
    *(2**64, -(2**31), -(2**40), 10**400, 0.5, -0.5, 1e-13, 1e-12, 1e12, 1e13, 1e300, -1e300),
    *(float("nan"), float("inf"), float("-inf"), True, False, None, "1", [], {}, [1], {"0": 1}),
)
TYPES = (
    *("u8", "i8", "u16", "i16", "u32", "i32", "f32", "char", "u64", "f64", "O", "V9", "", "u8[0]"),
    *("u8[1]", "u16[3]", "char[16]", "char[400]", "u8[99999999]", "u8[-1]", "u8[ 2]", "u8[2][2]"),
)
_HEADER_FIELDS = ((4, 4), (8, 4), (12, 4), (16, 4), (20, 4), (24, 2), (26, 1), (27, 1))
_EDGES = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xEE6B2800, 0xFFFFFFFF)


def sealed(body: bytes | bytearray) -> bytes:
    """Return a block with the CRC that its bytes ask for."""
    return bytes(body[: BLOCK - 4]) + struct.pack("<I", zlib.crc32(body[: BLOCK - 4]))


def forge_headers(data: bytes, rng: np.random.Generator) -> bytes:
    """Put edges of its range, or anything, into header fields of some blocks."""
    forged = bytearray(data)
    for start in _some(data, rng):
        at, size = _HEADER_FIELDS[int(rng.integers(len(_HEADER_FIELDS)))]
        value = int(rng.choice(_EDGES)) if rng.random() < 0.6 else int(rng.integers(2**32))
        if at == 24 and rng.random() < 0.8:  # `used`: beyond 480 the block would not count
            value = int(rng.integers(ROOM + 1))
        if at == 26:
            value &= 1
        forged[start + at : start + at + size] = (value % 256**size).to_bytes(size, "little")
        forged[start : start + BLOCK] = sealed(forged[start : start + BLOCK])
    return bytes(forged)


def forge_payloads(data: bytes, rng: np.random.Generator) -> bytes:
    """Put anything, or edges, into the frames of some blocks."""
    forged = bytearray(data)
    for start in _some(data, rng):
        at = start + 28 + int(rng.integers(ROOM - 4))
        size = int(rng.integers(1, min(80, start + BLOCK - 4 - at) + 1))
        filler = bytes([int(rng.choice([0, 1, 6, 7, 0x7F, 0x80, 0xFF]))]) * size
        forged[at : at + size] = rng.bytes(size) if rng.random() < 0.6 else filler
        forged[start : start + BLOCK] = sealed(forged[start : start + BLOCK])
    return bytes(forged)


def forge_order(data: bytes, rng: np.random.Generator) -> bytes:
    """Give blocks each other's numbers, or numbers far apart."""
    forged = bytearray(data)
    step = int(rng.choice([1, 1, 2, 3, 1000, 2**20, 2**31]))
    shift = int(rng.integers(2**32)) if rng.random() < 0.3 else 0
    numbers = list(range(len(data) // BLOCK))
    if rng.random() < 0.5:
        rng.shuffle(numbers)
    for place, number in enumerate(numbers):
        start = place * BLOCK
        forged[start + 12 : start + 16] = struct.pack("<I", (number * step + shift) % 2**32)
        forged[start : start + BLOCK] = sealed(forged[start : start + BLOCK])
    return bytes(forged)


def forge_sessions(data: bytes, rng: np.random.Generator) -> bytes:
    """Spread sessions or file ids over the blocks."""
    forged = bytearray(data)
    at = int(rng.choice([4, 8]))
    kinds = int(rng.integers(2, 40))
    for start in range(0, len(data) // BLOCK * BLOCK, BLOCK):
        if rng.random() < 0.5:
            forged[start + at : start + at + 4] = struct.pack("<I", int(rng.integers(kinds)))
            forged[start : start + BLOCK] = sealed(forged[start : start + BLOCK])
    return bytes(forged)


def forge_pieces(data: bytes, rng: np.random.Generator) -> bytes:
    """Change offset, total or text of pieces of the schema."""
    forged = bytearray(data)
    for start in range(0, len(data) // BLOCK * BLOCK, BLOCK):
        if data[start + 26] == 1 and rng.random() < 0.3:
            at = start + 28 + int(rng.choice([0, 2, 4 + int(rng.integers(400))]))
            forged[at : at + 2] = rng.bytes(2)
            forged[start : start + BLOCK] = sealed(forged[start : start + BLOCK])
    return bytes(forged)


def forge_schema_text(data: bytes, rng: np.random.Generator) -> bytes:
    """Change bytes of the schema text."""

    def change(text: bytes) -> bytes:
        changed = bytearray(text or b"{}")
        for _ in range(int(rng.integers(1, 6))):
            at = int(rng.integers(len(changed)))
            kind = rng.integers(4)
            if kind == 0:
                changed[at] = int(rng.integers(256))
            elif kind == 1:
                del changed[at : at + int(rng.integers(1, 40))]
            elif kind == 2:
                changed[at:at] = bytes(changed[at : at + int(rng.integers(1, 40))])
            else:
                changed[at:at] = rng.choice(_TOKENS)
            changed = changed or bytearray(b"{}")
        return bytes(changed)

    return with_schema(data, change)


def forge_schema(data: bytes, rng: np.random.Generator) -> bytes:
    """Change names, types, numbers or the shape of the schema."""

    def change(text: bytes) -> bytes:
        try:
            schema = json.loads(text)
        except (ValueError, RecursionError):  # already forged as text
            return text
        if not isinstance(schema, dict):
            return text
        for _ in range(int(rng.integers(1, 4))):
            _change_schema(schema, rng)
        return json.dumps(schema, separators=(",", ":")).encode("ascii")

    return with_schema(data, change)


FORGERIES: Mapping[str, Forgery] = {
    "headers": forge_headers,
    "payloads": forge_payloads,
    "order": forge_order,
    "sessions": forge_sessions,
    "pieces of the schema": forge_pieces,
    "schema as text": forge_schema_text,
    "schema": forge_schema,
}
_TOKENS = tuple(
    np.array([b"[" * 2000, b"{", b"]", b'"', b"1e999", b"NaN", b"-", b"\\u001b", b"\xff", b"null",
              b'"../x"', b"9" * 5000, b",", b":", b"0"], object)
)  # fmt: skip


def with_schema(data: bytes, change: Callable[[bytes], bytes]) -> bytes:
    """Return a log with another schema: its blocks name it, and the first session carries it."""
    blocks = [data[at : at + BLOCK] for at in range(0, len(data) // BLOCK * BLOCK, BLOCK)]
    parts: dict[int, bytes] = {}
    for one in blocks:
        if one[26] == 1:
            offset, used = (
                int.from_bytes(one[28:30], "little"),
                int.from_bytes(one[24:26], "little"),
            )
            parts.setdefault(offset, one[32 : 28 + used])
    text = change(b"".join(parts[offset] for offset in sorted(parts)))[:65_535]
    value = zlib.crc32(text)
    first = blocks[0] if blocks else bytes(BLOCK)
    head = {
        "file_id": int.from_bytes(first[4:8], "little"),
        "session": int.from_bytes(first[8:12], "little"),
        "schema_hash": value,
    }
    made: list[bytes] = []
    for at in range(0, max(1, len(text)), SCHEMA_ROOM):
        payload = struct.pack("<HH", at, len(text)) + text[at : at + SCHEMA_ROOM]
        made.append(block(payload, sequence=len(made), kind=1, **head))
    for one in blocks:
        if one[26] == 0:
            body = one[:12] + struct.pack("<II", len(made), value) + one[20:]
            made.append(sealed(body))
    return b"".join(made)


def _change_schema(schema: dict[str, Any], rng: np.random.Generator) -> None:
    def pick(values: Any) -> Any:
        return values[int(rng.integers(len(values)))]

    frames = schema.get("frames")
    frame: Any = pick(frames) if isinstance(frames, list) and frames else None
    rows = frame.get("fields") if isinstance(frame, dict) else None
    row: Any = pick(rows) if isinstance(rows, list) and rows else None
    if not isinstance(rows, list) or not isinstance(row, list) or len(row) < 2:
        schema[pick(["format", "version", "bits", "enum", "columns"])] = pick(NUMBERS)
        return
    choice = int(rng.integers(12))
    if choice == 0:
        frame["name"] = pick(NAMES)
    elif choice == 1:
        row[0] = pick(NAMES)
    elif choice == 2:
        row[1] = pick(TYPES)
    elif choice == 3:
        row += [""] * max(0, 10 - len(row))
        at = int(rng.integers(2, 10))
        row[at] = pick(NAMES if rng.random() < 0.4 else NUMBERS)
        row[at + 1 :] = []
    elif choice == 4:
        frame["id"] = pick(NUMBERS)
    elif choice == 5:
        rows.remove(row)
    elif choice == 6:
        rows.insert(int(rng.integers(len(rows) + 1)), list(row))
    elif choice == 7:
        schema["frames"].remove(frame)
    elif choice == 8:
        schema["frames"].append(json.loads(json.dumps(frame)))
    elif choice == 9:
        table = schema.get(pick(["bits", "enum"]))
        if isinstance(table, dict) and table:
            table[pick([*NAMES, *table])] = pick([*NUMBERS, *NAMES, list(NAMES), ["a"] * 40])
    elif choice == 10:
        name, kind = pick([*NAMES, "file", "units", "notes", "more"]), pick(TYPES)
        rows += [[f"{name}{at or ''}", kind] for at in range(int(rng.choice([1, 1, 2, 60, 300])))]
    else:
        schema[pick(["format", "version", "bits", "enum", "columns", "frames"])] = pick(NUMBERS)


def _some(data: bytes, rng: np.random.Generator) -> list[int]:
    count = len(data) // BLOCK
    if not count:
        return []
    return [BLOCK * at for at in rng.integers(0, count, int(rng.integers(1, 8))).tolist()]
