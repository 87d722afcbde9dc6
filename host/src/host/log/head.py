"""Identity and settings of a log from its head, without reading the rest."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from host.log import read_log
from host.log.source import find_flights
from host.original.rows import looks_like_rows, parse_rows
from host.terminal import command_line
from host.text import shown
from host.wire.blocks import is_card

HEAD_BYTES = 256 << 10


def describe(path: Path) -> dict[str, Any]:
    """Return identity, settings and schema of a log from its first 256 KiB.

    Raises
    ------
    NotALogError
        If no intact block is there.
    """
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if looks_like_rows(head):
        variant = parse_rows(head).variant
        size = path.stat().st_size
        return {"file": str(path), "size_bytes": size, "format": f"original rows, {variant}"}
    # The logs of a card's image stand anywhere in it.
    log = read_log(path, limit_bytes=None if is_card(head) else HEAD_BYTES)
    out: dict[str, Any] = {
        "file": str(path),
        "size_bytes": path.stat().st_size,
        "file_id": f"{log.selection.file_id:08x}",
        "received": log.stream is not None,
        "session": log.selection.sessions[0],
        "schema": f"{log.schema.hash:08x}",
        "kinds_of_frames": len(log.schema.frames),
    }
    for name in ("identity", "config", "image"):
        frame = log.head(name)
        out[name] = {} if frame is None else _plain(frame)
    number = out["image"].get("hash")
    out["image"] = f"{number:08x}" if isinstance(number, int) and number else "unknown"
    coefficients = log.head("baro_coefficients")
    out["baro"] = (
        "unknown"
        if coefficients is None
        else log.schema.word("baro_sensor", int(coefficients["sensor"]))
    )
    return out


def describe_folder(folder: Path) -> list[dict[str, Any]]:
    """Return the logs of a folder, oldest first."""
    return [
        {
            "file": str(flight.path),
            "session": flight.session,
            "size_bytes": flight.size_bytes,
            "recorded": flight.recorded,
        }
        for flight in find_flights(folder)
    ]


def head_lines(head: dict[str, Any]) -> list[str]:
    """Return the head in words."""
    if "format" in head:
        return [
            f"rows         {head['file']}, {head['size_bytes']} bytes, {head['format']}",
            f"next         {command_line('host', 'decode', Path(head['file']))}",
        ]
    where = "radio        received" if head["received"] else f"file id      {head['file_id']}"
    lines = [
        f"log          {head['file']}, {head['size_bytes']} bytes",
        f"{where}, first session {head['session']}",
        f"schema       {head['schema']}, {head['kinds_of_frames']} kinds of frames",
        f"barometer    {head['baro']}",
        f"image        {head['image']}",
    ]
    for name in ("identity", "config"):
        values = ", ".join(f"{key} {value}" for key, value in head[name].items())
        lines.append(f"{name:<13}{values or 'not in the first 256 KiB'}")
    lines.append(f"next         {command_line('host', 'decode', Path(head['file']))}")
    return lines


def _plain(frame: Any) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name in frame.dtype.names:
        value = frame[name]
        if name in ("id", "t_us"):
            continue
        if value.dtype.kind == "S":
            out[name] = shown(bytes(value).rstrip(b"\0"))
        elif value.ndim:
            out[name] = bytes(value).hex()
        else:
            number = value.item()
            out[name] = number if math.isfinite(number) else None
    return out
