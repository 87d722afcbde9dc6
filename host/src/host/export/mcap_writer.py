"""MCAP with JSON messages (mcap.dev): rows of a table, events, what belongs to them attached."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from host.arrays import Array

_NOTHING = re.compile(r":(?:nan|inf|-inf)(?=[,}])")
_ROWS_AT_ONCE = 1 << 14


def write_mcap(
    path: Path,
    columns: Mapping[str, Array],
    times_ns: Sequence[int],
    *,
    topic: str,
    texts: Mapping[str, str],
    events: Sequence[tuple[int, str]],
    attachments: Mapping[str, bytes],
    notes: Mapping[str, str],
) -> None:
    """Write a table and its events.

    Parameters
    ----------
    path : Path
    columns : mapping of str to (rows,) array
        NaN becomes null.
    times_ns : sequence of int
        Times of the rows, since 1970 (UTC).
    topic : str
        Topic of the rows; events stand under ``/events``.
    texts : mapping of str to str
        Unit and meaning of each column: into the schema.
    events : sequence of (int, str)
    attachments : mapping of str to bytes
        Files that belong to it, by name.
    notes : mapping of str to str
        Metadata.

    Raises
    ------
    ModuleNotFoundError
        mcap is missing.
    OSError
        The file cannot be written.
    """
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD, chunk_size=1 << 20)
        writer.start(profile="", library="flight-test-host")
        own = writer.register_channel(topic, "json", _schema(writer, "row", columns, texts))
        at = 0
        for piece in _rows(columns, len(times_ns)):
            for body in piece:
                writer.add_message(own, times_ns[at], body, times_ns[at])
                at += 1
        said = writer.register_channel("/events", "json", _text_schema(writer))
        for at_ns, text in events:
            writer.add_message(said, at_ns, json.dumps({"text": text}).encode(), at_ns)
        first = times_ns[0] if len(times_ns) else 0
        for name, data in attachments.items():
            writer.add_attachment(first, first, name, "text/plain", data)
        writer.add_metadata("flight", dict(notes))
        finish: Any = writer.finish
        finish()


def _rows(columns: Mapping[str, Array], count: int) -> list[list[bytes]]:
    form = "{" + ",".join(f'"{name}":%.{_digits(name)}g' for name in columns) + "}"
    values = list(columns.values())
    pieces = []
    for first in range(0, count, _ROWS_AT_ONCE):
        table = np.column_stack([one[first : first + _ROWS_AT_ONCE] for one in values]).tolist()
        pieces.append([_NOTHING.sub(":null", form % tuple(row)).encode() for row in table])
    return pieces


def _digits(name: str) -> int:
    """Return how many digits: those of a sensor, of places 1 cm, of time 1 us over a day."""
    return 11 if name == "t_s" or name.endswith("tude_deg") else 7


def _schema(writer: Any, name: str, columns: Mapping[str, Array], texts: Mapping[str, str]) -> int:
    properties = {
        one: {"type": ["number", "null"], "description": texts.get(one, "")} for one in columns
    }
    document = {"type": "object", "title": name, "properties": properties}
    data = json.dumps(document).encode()
    made: int = writer.register_schema(name, "jsonschema", data)
    return made


def _text_schema(writer: Any) -> int:
    document = {"type": "object", "title": "event", "properties": {"text": {"type": "string"}}}
    data = json.dumps(document).encode()
    made: int = writer.register_schema("event", "jsonschema", data)
    return made
