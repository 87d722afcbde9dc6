"""How much a file may become in memory, asked before it is made."""

from __future__ import annotations

from pathlib import Path

from host.errors import IdentificationError

MOST_BYTES, MOST_PER_BYTE = 300_000_000, 8  # SECURITY.md


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
