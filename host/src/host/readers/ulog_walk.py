"""Walk over the heads of a ULog's messages to find bytes that belong to none.

pyulog reports neither a cut file nor bytes that are no message.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

HEAD_BYTES = 16
KINDS = frozenset(b"BFIMPQARDLCSO")
LONGEST_BYTES = 256 << 20  # a larger file is not walked: half a minute


@dataclass(frozen=True, slots=True)
class Walk:
    """Bytes that belong to no message, from where on, and bytes of a last message that is cut."""

    strange: int = 0
    strange_at: int = 0
    rest: int = 0


def walk(path: Path) -> Walk:
    """Walk over the messages of a log."""
    size = path.stat().st_size
    if size > LONGEST_BYTES:
        return Walk()
    data = path.read_bytes()
    appended = _appended(data)
    at, strange, first = HEAD_BYTES, 0, 0
    while at + 3 <= size:
        length, kind = data[at] | data[at + 1] << 8, data[at + 2]
        if kind in KINDS and length:
            if at + 3 + length > size:
                break
            at += 3 + length
            continue
        if at in appended:  # data that a crash handler put behind a log of zeros
            at += 1
            continue
        first = first or at
        strange += 1
        at += 1
    return Walk(strange, first, size - at)


def _appended(data: bytes) -> frozenset[int]:
    """Return the offsets of data appended to the log, from its flags."""
    if len(data) < 59 or data[18:19] != b"B":
        return frozenset()
    return frozenset(struct.unpack_from("<3Q", data, HEAD_BYTES + 3 + 16))
