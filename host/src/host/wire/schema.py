"""The schema text of a log -> frames, fields and numpy dtypes (protocol/README.md, "Schema")."""

from __future__ import annotations

import json
import re
import zlib
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from host.errors import LogError
from host.resources import released_schemas, resource

_TYPES = {
    "u8": "u1",
    "i8": "i1",
    "u16": "<u2",
    "i16": "<i2",
    "u32": "<u4",
    "i32": "<i4",
    "f32": "<f4",
}
_TYPE = re.compile(r"(u8|i8|u16|i16|u32|i32|f32|char)(?:\[(\d+)\])?")
_FORMAT = "flight-test-log"
_VERSION = 1


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a frame.

    Parameters
    ----------
    name, type, unit, axis : str
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
    axis: str = ""
    invalid: int | None = None
    valid: int | None = None
    age: str | None = None
    delay_us: float | dict[int, float] | None = None
    table: str | None = None

    @property
    def numpy_type(self) -> np.dtype[Any]:
        """Packed little-endian numpy type of the field."""
        match = _TYPE.fullmatch(self.type)
        if match is None:
            raise LogError(f"the schema gives field {self.name} the unknown type {self.type!r}")
        base, count = match.groups()
        if base == "char":
            return np.dtype(f"S{count or 1}")
        return np.dtype((_TYPES[base], (int(count),))) if count else np.dtype(_TYPES[base])


@dataclass(frozen=True)
class Frame:
    """One kind of frame: its id, name and fields in order."""

    id: int
    name: str
    rate_hz: float | str
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
    """All frames of one released format."""

    text: str
    frames: tuple[Frame, ...]
    bits: dict[str, tuple[str, ...]]
    enums: dict[str, dict[str, int]]

    @cached_property
    def hash(self) -> int:
        """CRC-32 of the text, as it stands in every block."""
        return zlib.crc32(self.text.encode("ascii"))

    @cached_property
    def by_name(self) -> dict[str, Frame]:
        """Frames by name."""
        return {frame.name: frame for frame in self.frames}

    @cached_property
    def by_id(self) -> dict[int, Frame]:
        """Frames by id."""
        return {frame.id: frame for frame in self.frames}

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


def parse_schema(text: str) -> Schema:
    """Parse the schema text of a log.

    Parameters
    ----------
    text : str
        JSON as protocol/README.md describes it.

    Returns
    -------
    Schema

    Raises
    ------
    LogError
        If the text is no schema of a version this program knows.
    """
    try:
        raw = json.loads(text)
        if raw["format"] != _FORMAT or raw["version"] != _VERSION:
            raise LogError(
                f"schema of format {raw['format']!r} version {raw['version']!r};"
                f" this program reads {_FORMAT!r} version {_VERSION}: install a newer host tool"
            )
        columns = raw["columns"]
        frames = tuple(
            Frame(
                id=int(frame["id"]),
                name=str(frame["name"]),
                rate_hz=frame["rate_hz"],
                fields=tuple(_field(columns, row) for row in frame["fields"]),
            )
            for frame in raw["frames"]
        )
        bits = {name: tuple(words) for name, words in raw["bits"].items()}
        enums = {name: dict(words) for name, words in raw["enum"].items()}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise LogError(f"the log's schema cannot be read: {error!r}") from error
    return Schema(text, frames, bits, enums)


@lru_cache(maxsize=1)
def known_schemas() -> dict[int, str]:
    """Return the texts of all schemas that firmware was ever released with, by their hash."""
    texts = [_text_of(path) for path in (resource("schema.json"), *released_schemas())]
    return {zlib.crc32(text.encode("ascii")): text for text in texts}


def _text_of(path: Path) -> str:
    return path.read_text(encoding="ascii").split("\n")[1]


@lru_cache(maxsize=1)
def packed_schema() -> Schema:
    """Return the schema this host tool was built with.

    Writers of synthetic logs use it.
    """
    return parse_schema(_text_of(resource("schema.json")))


def _field(columns: list[str], row: list[Any]) -> Field:
    value = dict(zip(columns, row, strict=False))
    delay = value.get("delay_us")
    if isinstance(delay, dict):
        delay = {int(key): float(number) for key, number in delay.items()}
    return Field(
        name=str(value["name"]),
        type=str(value["type"]),
        unit=str(value.get("unit", "")),
        scale=float(value.get("scale", 1.0)),
        axis=str(value.get("axis", "")),
        invalid=value.get("invalid"),
        valid=value.get("valid"),
        age=value.get("age"),
        delay_us=delay,
        table=value.get("table"),
    )
