"""What a gzip holds, as a file: its expanded size is asked first, and held while it is made."""

from __future__ import annotations

import atexit
import gzip
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory

from host.readers.autopilot_log import NotAutopilotLogError
from host.readers.expanded_size import check_size

MAGIC = b"\x1f\x8b\x08"
PORTION_BYTES, SHORTEST_BYTES = 1 << 20, 18  # RFC 1952: head, checksum and size of an empty one
_made: dict[Path, Path] = {}  # by its gzip
_given: dict[Path, Path] = {}


def is_gzip(source: Path) -> bool:
    """Return whether a file begins like a gzip."""
    if not source.is_file():
        return False
    with source.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def expanded(source: Path) -> Path:
    """Return a file with what a gzip holds, made once in a run and gone at its end.

    Raises
    ------
    IdentificationError
        If it would become larger than a file of its size may.
    NotAutopilotLogError
        If it is cut or damaged.
    """
    if source in _made and _made[source].is_file():
        return _made[source]
    name = source.stem if source.suffix.lower() == ".gz" else source.name
    cut = NotAutopilotLogError(
        f"{source}: a gzip that is cut or damaged; what is left of it: `gunzip < {source.name} >"
        f" {name}`"
    )
    if source.stat().st_size < SHORTEST_BYTES:
        raise cut
    with source.open("rb") as file:
        file.seek(-4, 2)
        said = int.from_bytes(file.read(), "little")  # of its last member, modulo 2^32
    folder = TemporaryDirectory(prefix="host-")
    atexit.register(folder.cleanup)
    target = Path(folder.name) / name
    try:
        with gzip.open(source) as packed, target.open("wb") as made:
            check_size(source, said, "a gzip that says how much it holds")
            while portion := packed.read(PORTION_BYTES):
                made.write(portion)
                check_size(source, made.tell(), "a gzip that goes on")
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise cut from None
    _made[source], _given[target] = target, source
    return target


def as_given(text: str) -> str:
    """Return a line with the name of a gzip in place of the file that was made of it."""
    for made, source in _given.items():
        text = text.replace(str(made), str(source))
    return text


def given_path(path: Path) -> Path:
    """Return the gzip that a file was made of; else the file itself."""
    return _given.get(path, path)
