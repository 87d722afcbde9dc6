"""Arrays of a MAT file of versions 4 to 7, by numpy from the layout that MathWorks documents.

Real numbers and structs are read; text, cells, sparse matrices and objects are named and left
alone. Every size is held against the bytes that are there, nesting and number of parts are bounded,
and a compressed part is expanded no further than `check_size` allows.

Source: MATLAB MAT-File Format, MathWorks, R2024a.
"""

from __future__ import annotations

import itertools
import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from host.readers.expanded_size import check_size

_HEAD_BYTES, _TAG_BYTES, _OLD_HEAD_BYTES = 128, 8, 20
_AT_ONCE = 1 << 20
_DEEPEST, _MOST_ARRAYS = 32, 100_000
_TYPES = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _TEXT, _SPARSE, _NUMBERS, _OPAQUE = 1, 2, 3, 4, 5, range(6, 16), 17
_COMPLEX = 0x800  # of an array's flags
_OLD_TYPES = ("f8", "f4", "i4", "i2", "u2", "u1")

TEXT = "text"
CELL = "a cell array or a MATLAB object, not numbers"
OBJECT = "a MATLAB object (table, timeseries): save table2struct(T, 'ToScalar', true)"
COMPLEX = "not of real numbers"


class MatError(Exception):
    """The bytes are no MAT file, or one that is damaged."""


@dataclass(frozen=True, slots=True)
class Struct:
    """Structs of the same fields: for each field the values of all of them."""

    fields: dict[str, list[Value]]


Value = Any  # an array of numbers without axes of length one, a `Struct`, or why it is neither


def read_arrays(source: Path) -> Iterator[tuple[str, Value]]:
    """Yield the variables of a file by name.

    Raises
    ------
    MatError
        If the file is none, or damaged.
    IdentificationError
        If it would become larger than its size is worth.
    """
    data = memoryview(source.read_bytes())
    try:
        if b"\0" in bytes(data[:4]):
            yield from _old(data)
            return
        order = {b"IM": "<", b"MI": ">"}.get(bytes(data[126:128]))
        if order is None:
            raise MatError("no mark of its byte order")
        yield from _Arrays(source, order).variables(data[_HEAD_BYTES:])
    except struct.error:
        raise MatError("it ends within an element") from None
    except UnicodeDecodeError as error:
        raise MatError(f"a name that is no text: {error}") from None


@dataclass(slots=True)
class _Arrays:
    """Walks through the elements of a file of versions 5 to 7."""

    source: Path
    order: str
    expanded_bytes: int = 0
    arrays: int = 0
    depth: int = 0

    def variables(self, data: memoryview) -> Iterator[tuple[str, Value]]:
        """Yield names and values of neighbouring elements."""
        while len(data):
            kind, part, data = self.element(data, padded=False)
            if kind == _COMPRESSED:
                kind, part = self.expanded(part)
            if kind != _MATRIX:
                raise MatError(f"an element of type {kind} where an array is expected")
            name, value = self.array(part)
            if name:  # objects keep their contents in an array without one
                yield name, value

    def element(self, data: memoryview, *, padded: bool = True) -> tuple[int, memoryview, Any]:
        """Return the type of the first element, its bytes, and what follows."""
        kind, size = struct.unpack_from(f"{self.order}2I", data)
        if kind >> 16:  # up to four bytes stand in the tag itself
            kind, size = kind & 0xFFFF, kind >> 16
            if size > 4:
                raise MatError(f"a small element of {size} bytes")
            return kind, data[4 : 4 + size], data[_TAG_BYTES:]
        part = data[_TAG_BYTES : _TAG_BYTES + size]
        if len(part) != size:
            raise MatError(f"an element of {size} bytes where {len(part)} are left")
        whole = size + (-size % 8 if padded else 0)
        return kind, part, data[_TAG_BYTES + whole :]

    def expanded(self, part: memoryview) -> tuple[int, memoryview]:
        """Return type and bytes of the element that a compressed one holds."""
        expander = zlib.decompressobj()
        try:
            head = expander.decompress(part, _TAG_BYTES)
            kind, size = struct.unpack(f"{self.order}2I", head)
            self.grown(size, "its compressed parts expand")
            made, at = bytearray(size), 0
            while not expander.eof:
                piece = expander.decompress(expander.unconsumed_tail, _AT_ONCE)
                if at + len(piece) > size or not (piece or expander.eof):
                    break
                made[at : at + len(piece)] = piece
                at += len(piece)
        except zlib.error as error:
            raise MatError(str(error)) from None
        if at != size or not expander.eof:
            raise MatError(f"a compressed element that is not of {size} bytes")
        return kind, memoryview(made)

    def array(self, data: memoryview) -> tuple[str, Value]:
        """Return name and value of an array."""
        self.arrays += 1
        if self.arrays > _MOST_ARRAYS:
            raise MatError(f"more than {_MOST_ARRAYS} arrays")
        if not len(data):
            return "", np.empty(0)
        _, part, data = self.element(data)
        flags = struct.unpack_from(f"{self.order}I", part)[0]
        kind = flags & 0xFF
        if kind == _OPAQUE:
            return self.text(self.element(data)[1]), OBJECT
        _, part, data = self.element(data)
        shape = np.frombuffer(part, f"{self.order}i4").tolist() if len(part) % 4 == 0 else []
        if len(shape) < 2 or min(shape) < 0:
            raise MatError(f"an array of {len(shape)} sizes {shape[:4]}")
        _, part, data = self.element(data)
        name = self.text(part)
        if kind in _NUMBERS:
            return name, COMPLEX if flags & _COMPLEX else self.numbers(data, shape)
        if kind == _TEXT:
            return name, TEXT
        if kind in (_STRUCT, _OBJECT):
            return name, self.structs(data, math.prod(shape), kind == _OBJECT)
        if kind == _CELL and math.prod(shape) == 1:
            return name, self.inner(data)[0]
        return name, CELL

    def numbers(self, data: memoryview, shape: list[int]) -> Value:
        """Return the real numbers of an array, as the file keeps them."""
        kind, part, _ = self.element(data)
        if kind not in _TYPES:
            raise MatError(f"numbers of type {kind}")
        values = _shaped(part, f"{self.order}{_TYPES[kind]}", shape)
        if values.ndim <= 2 and values.dtype != np.float64:
            self.grown(values.size * 8, "its numbers become columns")
        return values

    def grown(self, more_bytes: int, what: str) -> None:
        """Count what is made of the file, as large as it becomes."""
        self.expanded_bytes += more_bytes
        check_size(self.source, self.expanded_bytes, what)

    def structs(self, data: memoryview, count: int, named: bool) -> Struct:
        """Return structs, field by field."""
        if named:  # the class of an object
            _, _, data = self.element(data)
        _, part, data = self.element(data)
        width = struct.unpack_from(f"{self.order}i", part)[0]
        _, part, data = self.element(data)
        if width < 1 or len(part) % width:
            raise MatError(f"names of fields of {len(part)} bytes, {width} each")
        names = [self.text(part[k : k + width]) for k in range(0, len(part), width)]
        values: list[list[Value]] = [[] for _ in names]
        for _ in range(count if names else 0):
            for of_field in values:
                value, data = self.inner(data)
                of_field.append(value)
        return Struct(dict(zip(names, values, strict=True)))

    def inner(self, data: memoryview) -> tuple[Value, memoryview]:
        """Return the first array within another one, and what follows."""
        kind, part, data = self.element(data)
        if kind != _MATRIX:
            raise MatError(f"an element of type {kind} where an array is expected")
        if self.depth == _DEEPEST:
            raise MatError(f"arrays within arrays, more than {_DEEPEST} deep")
        self.depth += 1
        value = self.array(part)[1]
        self.depth -= 1
        return value, data

    @staticmethod
    def text(part: memoryview) -> str:
        """Return a name."""
        return bytes(part).split(b"\0")[0].decode("utf-8")


def _old(data: memoryview) -> Iterator[tuple[str, Value]]:
    """Yield the matrices of a file of version 4."""
    for number in itertools.count():
        if not len(data):
            return
        if number == _MOST_ARRAYS:
            raise MatError(f"more than {_MOST_ARRAYS} arrays")
        order = "<" if 0 <= struct.unpack_from("<i", data)[0] <= 5000 else ">"
        code, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", data)
        machine, kind, form = code // 1000, code // 10 % 10, code % 10
        if machine > 1 or code // 100 % 10 or kind >= len(_OLD_TYPES) or form > 2:
            raise MatError(f"a matrix of type {code}")
        if min(rows, columns, length) < 0:
            raise MatError(f"a matrix of {rows} x {columns}")
        dtype = np.dtype(f"{order}{_OLD_TYPES[kind]}")
        start = _OLD_HEAD_BYTES + length
        name = _Arrays.text(data[_OLD_HEAD_BYTES:start])
        size = rows * columns * dtype.itemsize
        end = start + (2 if imaginary and form != 2 else 1) * size
        if end > len(data):
            raise MatError(f"a matrix of {size} bytes where {len(data) - start} are left")
        if form:
            yield name, TEXT if form == 1 else CELL
        elif imaginary:
            yield name, COMPLEX
        else:
            yield name, _shaped(data[start : start + size], dtype.str, [rows, columns])
        data = data[end:]


def _shaped(part: memoryview, dtype: str, shape: list[int]) -> Value:
    if len(part) != math.prod(shape) * np.dtype(dtype).itemsize:
        raise MatError(f"{len(part)} bytes of an array of {' x '.join(map(str, shape[:8]))}")
    values = np.frombuffer(part, dtype)
    if not values.size:
        return values
    return values.reshape([n for n in shape if n != 1], order="F")
