"""How much a file may become in memory, asked before it is made."""

from __future__ import annotations

import zlib
from pathlib import Path

from host.errors import IdentificationError

MOST_BYTES, MOST_PER_BYTE = 300_000_000, 8  # SECURITY.md
_HEAD_BYTES, _TAG_BYTES, _COMPRESSED = 128, 8, 15  # of a MAT file of version 5
_AT_ONCE = 1 << 20


def check_size(source: Path, expanded_bytes: int, what: str) -> None:
    """Refuse a file that would become larger than its size is worth.

    Raises
    ------
    IdentificationError
    """
    most = MOST_BYTES + MOST_PER_BYTE * source.stat().st_size
    if expanded_bytes > most:
        raise IdentificationError(
            f"{source}: {what}, {expanded_bytes / 1e6:.0f} MB or more where at most"
            f" {most / 1e6:.0f} MB are made of a file of its size; is it damaged?"
        )


def ask_expanded_size(source: Path) -> None:
    """Refuse a MAT file whose compressed parts would be too large; expands and forgets them.

    Raises
    ------
    IdentificationError
    """
    with source.open("rb") as file:
        order = "big" if file.read(_HEAD_BYTES)[126:128] == b"MI" else "little"
        total = 0
        while len(tag := file.read(_TAG_BYTES)) == _TAG_BYTES:
            size = int.from_bytes(tag[4:], order)  # type: ignore[arg-type]
            if int.from_bytes(tag[:4], order) != _COMPRESSED:  # type: ignore[arg-type]
                file.seek(size, 1)
                continue
            expander = zlib.decompressobj()
            while size > 0 and (data := file.read(min(size, _AT_ONCE))):
                size -= len(data)
                while data and not expander.eof:
                    try:
                        total += len(expander.decompress(data, _AT_ONCE))
                    except zlib.error:
                        return  # the reader says so
                    data = expander.unconsumed_tail
                    check_size(source, total, "its compressed parts expand")
