"""Notes of a ground station on the bytes it receives: one JSON object per line.

The bytes stay as they came (`NAME.radio`); `NAME.radio.jsonl` next to them begins with the head and
goes on with events: marks, resets of the line, unknown schema hashes. host/LIVE.md has the table.
The bytes alone decode too; only the events are then lost.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

FORMAT = "flight-test-capture"
VERSION = 1
SUFFIX = ".radio"
_MOST_BYTES = 1 << 20  # of the first line: schema and calibration are 20 kB


@dataclass(frozen=True, slots=True)
class CaptureHead:
    """The first line.

    Parameters
    ----------
    source : str
        As the user named it.
    baud : int
        Baud rate of a serial line; 0 for none.
    started_utc : str
        Computer time when the capture began, ISO 8601.
    schema : str
        Schema this host tool was built with; the stream names only the hash of its own.
    calibration : str
        Text of the calibration that was shown.
    calibration_name : str
    host : str
        Version of this tool.
    """

    source: str = ""
    baud: int = 0
    started_utc: str = ""
    schema: str = ""
    calibration: str = ""
    calibration_name: str = ""
    host: str = ""

    @property
    def schema_text(self) -> bytes:
        """The schema as it would stand in a log."""
        return self.schema.encode("ascii", "replace")

    @property
    def calibration_text(self) -> str:
        """The calibration as TOML."""
        return self.calibration

    def line(self) -> str:
        """Return the line, with its end."""
        return json.dumps({"format": FORMAT, "version": VERSION} | asdict(self)) + "\n"


def notes_path(path: Path) -> Path:
    """Return where the notes of a capture stand."""
    return path.with_name(path.name + ".jsonl")


def read_capture_head(path: Path) -> CaptureHead | None:
    """Return the head of a capture; None without one, or where it is no head of ours."""
    row = _first_row(notes_path(path))
    if row is None or row.get("format") != FORMAT or row.get("version") != VERSION:
        return None
    texts = {
        name: value
        for name in CaptureHead.__slots__
        if name != "baud" and isinstance(value := row.get(name), str)
    }
    baud = row.get("baud")
    return CaptureHead(**texts, baud=baud if isinstance(baud, int) else 0)


def _first_row(path: Path) -> dict[str, Any] | None:
    if not path.is_file():
        return None
    with path.open("rb") as file:
        line = file.readline(_MOST_BYTES)
    try:
        row = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return row if isinstance(row, dict) else None
