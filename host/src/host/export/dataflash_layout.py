"""Layout of ArduPilot's DataFlash records, for the writer and the reader of them.

A record is A3 95, the number of its kind and a packed body. Kinds are described by records of kind
128 (FMT): number, length, name, a character for each field, and the fields' names. ArduPilot,
libraries/AP_Logger/LogStructure.h names the characters.
"""

from __future__ import annotations

import numpy as np

SYNC = b"\xa3\x95"
HEAD_BYTES = 3
FMT_KIND = 128
FMT_BYTES = 89
# Type and scale of a field by its character.
FIELDS: dict[str, tuple[str, float]] = {
    "b": ("<i1", 1.0), "B": ("<u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0),
    "i": ("<i4", 1.0), "I": ("<u4", 1.0), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
    "f": ("<f4", 1.0), "d": ("<f8", 1.0), "g": ("<f2", 1.0), "M": ("<u1", 1.0),
    "n": ("S4", 0.0), "N": ("S16", 0.0), "Z": ("S64", 0.0), "a": ("(32,)<i2", 0.0),
    "c": ("<i2", 0.01), "C": ("<u2", 0.01), "e": ("<i4", 0.01), "E": ("<u4", 0.01),
    "L": ("<i4", 1e-7),
}  # fmt: skip
FMT_FIELDS = ("BBnNZ", "Type,Length,Name,Format,Columns")


def record_type(letters: str, names: str) -> np.dtype[np.void]:
    """Return the packed type of a body.

    Raises
    ------
    ValueError
        If a letter is unknown, or letters and names are not as many.
    """
    columns = names.split(",") if names else []
    if len(columns) != len(letters) or len(set(columns)) != len(columns) or "" in columns:
        raise ValueError(f"{len(letters)} letters for the fields {names!r}")
    unknown = [letter for letter in letters if letter not in FIELDS]
    if unknown:
        raise ValueError(f"unknown letter {unknown[0]!r}")
    return np.dtype([(n, FIELDS[k][0]) for n, k in zip(columns, letters, strict=True)])
