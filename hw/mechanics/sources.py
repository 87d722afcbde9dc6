"""What the solids are made of, and its hash: committed figures name it; needs no CAD."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

HERE = Path(__file__).resolve().parent
SHIELD = HERE.parent / "board" / "logger.kicad_pcb"
COMPONENTS = HERE / "components.toml"
STACK = (COMPONENTS, HERE / "vane.toml", HERE / "solids.py", HERE / "stack.py", SHIELD)


def hash_of(paths: Iterable[Path]) -> str:
    """Return the hash of files, the same with any line ending."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()
