"""Reads the user's TOML and text files, with limits before parsing and after.

Every reader of an aircraft, calibration, map, model, prior, card or truth comes through here, so
that no such file can hang, fill the memory, or end in an error of the interpreter.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from host.errors import UsageError
from host.files.regular import regular_file

MOST_BYTES = 4 << 20  # the largest file of ours, the truth of an hour of flight, has 0.4 MB
DEEPEST = 12  # tables and lists within each other; ours go to 4
MOST_VALUES = 200_000
LONGEST_TEXT = 2000  # characters of one text; ours have 200
LONGEST_KEY = 100
LARGEST = 1e18  # larger than any meaningful number, small enough not to overflow
_DIGITS = 40  # shown of a number


def read_text(
    path: Path, error: type[UsageError], what: str = "text", encoding_errors: str = "strict"
) -> str:
    """Return the text of a file, at most `MOST_BYTES` of it.

    Parameters
    ----------
    path : Path
    error : type
        What to raise.
    what : str
        What it should be, for the message.
    encoding_errors : str
        For bytes that are no UTF-8: ``strict`` raises, ``replace`` serves files of old programs.

    Raises
    ------
    UsageError
        As `error`: no such file, a pipe, a folder, too large, or not UTF-8.
    """
    regular_file(path, error)
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as reason:
        raise error(f"{path}: cannot be read: {reason.strerror or reason}") from None
    if len(data) > MOST_BYTES:
        raise error(f"{path}: larger than {MOST_BYTES >> 20} MiB, that is no {what}")
    try:
        return data.decode("utf-8-sig", encoding_errors)
    except UnicodeDecodeError as reason:
        raise error(
            f"{path}: not {what}: byte {reason.start} is no UTF-8; save it as UTF-8"
        ) from None


def read_toml(path: Path, error: type[UsageError]) -> dict[str, Any]:
    """Return the tables of a TOML file.

    Every number in it is finite and within `LARGEST`; tables and lists are nested `DEEPEST` deep
    at most.

    Raises
    ------
    UsageError
        As `error`: it cannot be read, is no TOML, or is beyond those bounds; in one line.
    """
    return parse_toml(read_text(path, error, "TOML"), str(path), error)


def parse_toml(text: str, name: str, error: type[UsageError]) -> dict[str, Any]:
    """Do the same for a text that is read already; `name` stands before what is wrong."""
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise error(f"{name}: nested deeper than {DEEPEST} lists or tables") from None
    except ValueError as reason:  # tomllib's own error is one, so is that of too many digits
        raise error(f"{name}: not TOML: {reason}") from None
    _refuse_excess(document, name, error)
    return document


def _refuse_excess(document: dict[str, Any], name: str, error: type[UsageError]) -> None:
    """Walk through all values without recursion."""
    left: list[tuple[str, int, object]] = [("", 0, document)]
    count = 1
    while left:
        where, depth, value = left.pop()
        if isinstance(value, dict | list):
            count += len(value)
            if count > MOST_VALUES:
                raise error(f"{name}: more than {MOST_VALUES} values")
            if depth >= DEEPEST:
                raise error(f"{name}: {where}: nested deeper than {DEEPEST} lists or tables")
            inner = value.items() if isinstance(value, dict) else enumerate(value)
            for key, one in inner:
                if isinstance(key, str) and len(key) > LONGEST_KEY:
                    raise error(f"{name}: {where}: a key of more than {LONGEST_KEY} characters")
                step = f"[{key}]" if isinstance(key, int) else f".{key}" if where else key
                left.append((where + step, depth + 1, one))
        elif isinstance(value, str):
            if len(value) > LONGEST_TEXT:
                raise error(f"{name}: {where}: a text of more than {LONGEST_TEXT} characters")
        elif isinstance(value, int | float) and not abs(value) <= LARGEST:  # NaN too
            raise error(f"{name}: {where} is {shown(value)}, expected a number up to {LARGEST:g}")


def shown(value: object) -> str:
    """Return a value of a file for a message: cut where it is long."""
    text = hex(value) if isinstance(value, int) and abs(value) > LARGEST else repr(value)
    return text if len(text) <= _DIGITS else f"{text[:_DIGITS]}..."
