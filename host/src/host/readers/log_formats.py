"""Which format a log of an autopilot has, by its first bytes, and who reads it."""

from __future__ import annotations

from pathlib import Path

from host.errors import UsageError
from host.extras import install_hint
from host.readers.autopilot_log import FORMATS, AutopilotLog, NotAutopilotLogError
from host.readers.dataflash_messages import read_dataflash
from host.readers.ulog_messages import read_ulog

HEAD_BYTES = 4096
ULOG_MAGIC = b"ULog\x01\x12\x35"
MAVLINK_STARTS = (0xFD, 0xFE)
_EARLIEST_US, _LATEST_US = 10**15, 4 * 10**15  # 2001 to 2096: the clock of a ground station


def format_of_file(path: Path) -> str | None:
    """Return the format of a log, a key of `FORMATS`; None if it is none of them."""
    with path.open("rb") as file:
        return format_of(file.read(HEAD_BYTES), path.suffix.lower())


def format_of(head: bytes, suffix: str) -> str | None:
    """Return the format of what begins with these bytes and has this ending."""
    if head.startswith(ULOG_MAGIC):
        return "ulog"
    if head.startswith(b"\xa3\x95"):
        return "dataflash"
    if head.startswith(b"FMT, ") or (suffix == ".log" and b"\nFMT, " in head):
        return "dataflash-text"
    if suffix == ".tlog" or _looks_like_tlog(head):
        return "tlog"
    if suffix in (".ulg", ".ulog"):
        return "ulog"
    return None


def _looks_like_tlog(head: bytes) -> bool:
    """Return whether a time of this century and the start of a MAVLink frame stand first, twice."""
    at, seen = 0, 0
    while at + 10 <= len(head) and seen < 2:
        stamp = int.from_bytes(head[at : at + 8], "big")
        start, length = head[at + 8], head[at + 9]
        if start not in MAVLINK_STARTS or not _EARLIEST_US < stamp < _LATEST_US:
            return False
        signed = start == 0xFD and at + 11 <= len(head) and head[at + 10] & 1
        at += 8 + length + ((12 if start == 0xFD else 8) + (13 if signed else 0))
        seen += 1
    return seen == 2


def read_messages(path: Path) -> list[AutopilotLog]:
    """Read the messages of a log by its format: of each start of the autopilot's clock a log.

    Raises
    ------
    NotAutopilotLogError
        If it is none, or holds nothing.
    UsageError
        If the library that reads it is missing.
    """
    kind = format_of_file(path)
    if kind is None:
        raise NotAutopilotLogError(f"{path}: no {', '.join(FORMATS.values())}")
    if kind == "ulog":
        return [read_ulog(path)]
    try:
        if kind == "tlog":
            from host.readers.tlog_messages import read_tlog

            return read_tlog(path)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("host"):
            raise
        raise UsageError(
            f"{path}: {FORMATS[kind]} needs {error.name}: {install_hint(error.name)}"
        ) from None
    return read_dataflash(path, text=kind == "dataflash-text")
