"""A log as text: the text file of each log of tests/data.

Every value of every frame, raw, so that a decoder of later years can be held to it without
believing anything it derives from them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from host.log import FlightLog

from tests.protocol.oracle import Decoded

Row = Mapping[str, Any]


def text_of_oracle(log: Decoded, order: Sequence[str]) -> str:
    """Return the text of a log as the independent decoder reads it."""
    frames = {name: [row for row, _ in log.frames.get(name, [])] for name in order}
    return _text(log.file_id, log.sessions, log.complete, frames)


def text_of_host(log: FlightLog) -> str:
    """Return the text of a log as the host reads it."""
    frames = {}
    for name in log.frames:
        found = log.frames[name]
        columns = [column for column in (found.dtype.names or ()) if column != "id"]
        lists = [found[column].tolist() for column in columns]
        frames[name] = [dict(zip(columns, row, strict=True)) for row in zip(*lists, strict=True)]
    return _text(log.selection.file_id, list(log.selection.sessions), log.complete, frames)


def _text(
    file_id: int, sessions: Sequence[int], complete: str, frames: Mapping[str, Sequence[Row]]
) -> str:
    lines = [
        f"file id  0x{file_id:08x}",
        f"sessions {' '.join(str(session) for session in sessions)}",
        f"complete {complete}",
    ]
    for name, rows in frames.items():
        lines += ["", f"{name}: {len(rows)} frames"]
        if rows:
            columns = [column for column in rows[0] if not column.startswith("_")]
            lines.append(" ".join(columns))
            lines += [" ".join(_value(row[column]) for column in columns) for row in rows]
    return "\n".join([*lines, ""])


def _value(value: Any) -> str:
    if isinstance(value, bytes):
        return value.rstrip(b"\0").decode("ascii") or "-"
    if isinstance(value, list | tuple):
        return ",".join(str(one) for one in value)
    return str(value)
