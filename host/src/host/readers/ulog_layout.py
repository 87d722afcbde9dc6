"""The layout of a ULog's topics, from the log's own definitions; each definition is bounded.

A definition may name others. Each is reckoned once, so that time follows the text and never the
width; a message of the format holds at most 65 535 bytes, and what is wider is no definition.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# PX4's own logs: 250 definitions of together 60 kB, the widest topic read has 60 columns.
MOST_FORMATS, MOST_TEXT_BYTES = 4000, 1 << 20
MOST_COLUMNS = 512  # of a topic that is read
DEEPEST = 8
LARGEST_BYTES = 65535
TYPES = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4",
    "uint32_t": "<u4", "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8",
    "bool": "i1", "char": "i1",
}  # fmt: skip
_FIELD = re.compile(r"([A-Za-z_]\w{0,63})(?:\[(\d{1,5})\])? ([A-Za-z_]\w{0,63})", re.ASCII)
_NAME = re.compile(r"[A-Za-z_/][\w/-]{0,99}", re.ASCII)
_PADDING = "_padding"


class LayoutError(ValueError):
    """A definition that is none, or is beyond its bounds."""


@dataclass(frozen=True, slots=True)
class Field:
    """One entry of a definition: ``kind name`` or ``kind[count] name``."""

    kind: str
    count: int  # 0: no array
    name: str


class Formats:
    """The definitions of a log."""

    def __init__(self) -> None:
        self.left_out = 0  # definitions beyond the bounds
        self.twice: list[str] = []  # defined again, and otherwise
        self._texts: dict[str, str] = {}
        self._text_bytes = 0
        self._fields: dict[str, tuple[Field, ...]] = {}
        self._bytes: dict[str, int] = {}
        self._depth = 0

    def define(self, text: str) -> None:
        """Take ``name:kind field;kind field;``; of two of a name the first counts."""
        name, colon, fields = text.partition(":")
        if not colon or not _NAME.fullmatch(name):
            return
        if name in self._texts:
            if self._texts[name] != fields and name not in self.twice:
                self.twice.append(name)
            return
        if len(self._texts) == MOST_FORMATS or self._text_bytes + len(fields) > MOST_TEXT_BYTES:
            self.left_out += 1
            return
        self._texts[name] = fields
        self._text_bytes += len(fields)

    def sizes(self, name: str) -> tuple[int, int]:
        """Return the fewest and most bytes of a message: padding at its end may be left out.

        Raises
        ------
        LayoutError
            If there is no such definition, or it is none, or too wide.
        """
        whole = self._size(name)
        fields = self._parsed(name)
        padding = 0
        if fields and fields[-1].name.startswith(_PADDING):
            padding = self._field_bytes(fields[-1])
        return whole - padding, whole

    def columns(
        self, name: str, read: Callable[[str], bool]
    ) -> tuple[np.dtype[np.void], NDArray[np.intp]]:
        """Return the columns that are read, and the places of their bytes in a message.

        Parameters
        ----------
        name : str
        read : callable
            Says by a column's name, ``q[0]``, ``esc[1].rpm``, whether it is read.

        Raises
        ------
        LayoutError
            If there is none, or more than `MOST_COLUMNS`.
        """
        self._size(name)
        found: dict[str, tuple[str, int]] = {}

        def add(format_: str, before: str, at: int) -> None:
            for field in self._parsed(format_):
                size = self._field_bytes(field)
                each = size // max(field.count, 1)
                for k in range(0 if field.name.startswith(_PADDING) else max(field.count, 1)):
                    own = f"{before}{field.name}" + (f"[{k}]" if field.count else "")
                    if field.kind not in TYPES:
                        add(field.kind, f"{own}.", at + k * each)
                    elif read(own):
                        found.setdefault(own, (TYPES[field.kind], at + k * each))
                        if len(found) > MOST_COLUMNS:
                            raise LayoutError(f"{name}: more than {MOST_COLUMNS} columns")
                at += size

        add(name, "", 0)
        if not found:
            raise LayoutError(f"{name}: no columns")
        packed = np.dtype([(own, kind) for own, (kind, _) in found.items()])
        spans = [np.arange(at, at + np.dtype(kind).itemsize) for kind, at in found.values()]
        return packed, np.concatenate(spans)

    def _parsed(self, name: str) -> tuple[Field, ...]:
        if name not in self._fields:
            if name not in self._texts:
                raise LayoutError(f"{name}: not defined")
            found = []
            for part in filter(None, self._texts[name].split(";")):
                one = _FIELD.fullmatch(part)
                if one is None or one[2] == "0":
                    raise LayoutError(f"{name}: {part[:40]!r} is no field")
                found.append(Field(one[1], int(one[2] or 0), one[3]))
            self._fields[name] = tuple(found)
        return self._fields[name]

    def _field_bytes(self, field: Field) -> int:
        known = TYPES.get(field.kind)
        each = np.dtype(known).itemsize if known else self._size(field.kind)
        return each * max(field.count, 1)

    def _size(self, name: str) -> int:
        """Return the bytes of a whole message; -1 is noted for what is none."""
        if name not in self._bytes:
            self._bytes[name] = -1  # a definition that comes back to itself has no size
            self._depth += 1
            try:
                if self._depth > DEEPEST:
                    raise LayoutError(f"{name}: more than {DEEPEST} definitions deep")
                size = sum(self._field_bytes(field) for field in self._parsed(name))
            finally:
                self._depth -= 1
            if not 0 < size <= LARGEST_BYTES:
                raise LayoutError(f"{name}: {size} bytes")
            self._bytes[name] = size
        if self._bytes[name] < 0:
            raise LayoutError(f"{name}: no definition")
        return self._bytes[name]
