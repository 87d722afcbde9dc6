"""Frames, fields and numpy dtypes of a format (protocol/README.md, "Schema")."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

TYPES = {
    "u8": "u1",
    "i8": "i1",
    "u16": "<u2",
    "i16": "<i2",
    "u32": "<u4",
    "i32": "<i4",
    "f32": "<f4",
}


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a frame.

    Parameters
    ----------
    name, type, unit : str
        As in protocol/frames.toml.
    scale : float
        One raw step in `unit`.
    invalid : int or None
        Raw value that means "no value".
    valid : int or None
        Bit of the frame's ``valid`` field that is 1 while the value may be used.
    age : str or None
        Field that holds a further delay of each sample.
    delay_us : float or dict of int to float or None
        Sampling delay before ``t_us``, or a table keyed by the IMU's DLPF_CFG.
    table : str or None
        Name of the bits or enum that explains the number.
    """

    name: str
    type: str
    unit: str = ""
    scale: float = 1.0
    invalid: int | None = None
    valid: int | None = None
    age: str | None = None
    delay_us: float | dict[int, float] | None = None
    table: str | None = None

    @property
    def numpy_type(self) -> np.dtype[Any]:
        """Packed little-endian numpy type of the field."""
        base, _, count = self.type.rstrip("]").partition("[")
        if base == "char":
            return np.dtype(f"S{count or 1}")
        return np.dtype((TYPES[base], (int(count),))) if count else np.dtype(TYPES[base])


@dataclass(frozen=True)
class Frame:
    """One kind of frame: its id, name and fields in order."""

    id: int
    name: str
    fields: tuple[Field, ...]

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Packed dtype of a frame with its id byte in field ``id``."""
        return np.dtype([("id", "u1"), *((field.name, field.numpy_type) for field in self.fields)])

    @property
    def size_bytes(self) -> int:
        """Length of a frame with its id."""
        return self.dtype.itemsize

    def field(self, name: str) -> Field:
        """Return the field called `name`; KeyError if the frame has none."""
        for field in self.fields:
            if field.name == name:
                return field
        raise KeyError(name)


@dataclass(frozen=True)
class Schema:
    """All frames of one released format, checked by `host.wire.schema_text.parse_schema`."""

    text: bytes
    frames: tuple[Frame, ...]
    bits: dict[str, tuple[str, ...]]
    enums: dict[str, dict[str, int]]

    @cached_property
    def hash(self) -> int:
        """CRC-32 of the text, as it stands in every block."""
        return zlib.crc32(self.text)

    @cached_property
    def by_name(self) -> dict[str, Frame]:
        """Frames by name."""
        return {frame.name: frame for frame in self.frames}

    def bit(self, table: str, name: str) -> int:
        """Return the mask of one named bit, 0 if this format does not have it."""
        names = self.bits.get(table, ())
        return 1 << names.index(name) if name in names else 0

    def number(self, table: str, name: str) -> int:
        """Return the number behind a name of an enum; KeyError if it has none."""
        return self.enums[table][name]

    def word(self, table: str, number: int) -> str:
        """Return the name of a number of an enum, or the number in words."""
        for name, value in self.enums.get(table, {}).items():
            if value == number:
                return name
        return f"unknown ({number})"
