"""PX4 ULog: topics with their formats, parameters and information, in order of time.

File format: docs.px4.io, ULog File Format, version 1. Nobody else writes one: pyulog only writes
again what it has read.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAGIC = b"ULog\x01\x12\x35\x01"
_TYPES = {
    "u1": "uint8_t", "u2": "uint16_t", "u4": "uint32_t", "u8": "uint64_t", "i1": "int8_t",
    "i2": "int16_t", "i4": "int32_t", "i8": "int64_t", "f4": "float", "f8": "double", "b1": "bool",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Topic:
    """All messages of one topic and instance: a packed row each, `timestamp` (us) first."""

    name: str
    rows: NDArray[np.void]
    instance: int = 0


def topic(name: str, instance: int = 0, **fields: NDArray[Any]) -> Topic:
    """Return a topic of columns (n,) or (n, k), in the types they have, `timestamp` first."""
    layout = np.dtype(
        [(key, v.dtype.newbyteorder("<").str, v.shape[1:]) for key, v in fields.items()]
    )
    rows = np.zeros(len(fields["timestamp"]), dtype=layout)
    for key, values in fields.items():
        rows[key] = values
    return Topic(name, rows, instance)


def write_ulog(
    path: Path,
    topics: Sequence[Topic],
    *,
    parameters: Mapping[str, float | int],
    information: Mapping[str, str],
    start_us: int = 0,
    said: Sequence[tuple[int, str]] = (),
) -> None:
    """Write a log.

    Parameters
    ----------
    path : Path
    topics : sequence of Topic
    parameters : mapping
        Integers are written as ``int32_t``, the rest as ``float``.
    information : mapping of str to str
        ``sys_name``, ``ver_sw`` and the like.
    start_us : int
    said : sequence of (int, str)
        Logged texts with their times, us.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    parts = [MAGIC, struct.pack("<Q", start_us), _message("B", bytes(40))]
    parts += [
        _message("I", _keyed(f"char[{len(v)}] {k}", v.encode())) for k, v in information.items()
    ]
    for text in dict.fromkeys(_format(one) for one in topics):
        parts.append(_message("F", text.encode()))
    for name, value in parameters.items():
        whole = isinstance(value, int)
        packed = struct.pack("<i" if whole else "<f", value)
        parts.append(_message("P", _keyed(f"{'int32_t' if whole else 'float'} {name}", packed)))
    times, bodies = [], []
    for number, one in enumerate(topics):
        parts.append(_message("A", struct.pack("<BH", one.instance, number) + one.name.encode()))
        size, whole_rows = one.rows.dtype.itemsize, one.rows.tobytes()
        head = struct.pack("<HBH", size + 2, ord("D"), number)
        bodies += [head + whole_rows[k * size : (k + 1) * size] for k in range(len(one.rows))]
        times.append(one.rows["timestamp"].astype(np.int64))
    for at_us, text in said:
        bodies.append(_message("L", struct.pack("<BQ", ord("6"), at_us) + text.encode()))
    times.append(np.array([at_us for at_us, _ in said], np.int64))
    order = np.argsort(np.concatenate(times), kind="stable")
    parts += [bodies[k] for k in order.tolist()]
    path.write_bytes(b"".join(parts))


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def _keyed(key: str, value: bytes) -> bytes:
    return bytes([len(key)]) + key.encode() + value


def _format(one: Topic) -> str:
    fields = []
    for name in one.rows.dtype.names or ():
        base, shape = one.rows.dtype[name].base, one.rows.dtype[name].shape
        kind = _TYPES[base.str[1:]]
        fields.append(f"{kind}{f'[{shape[0]}]' if shape else ''} {name};")
    return f"{one.name}:{''.join(fields)}"
