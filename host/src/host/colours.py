"""Colours of what a terminal shows: by how a line begins, so that no text of a stranger paints.

None in a pipe or a file, none with NO_COLOR set (no-color.org), none on a dumb terminal.
"""

from __future__ import annotations

import os
import re
import sys
from typing import TextIO

_RED, _YELLOW, _GREEN, _BOLD, _END = "\033[31m", "\033[33m", "\033[32m", "\033[1m", "\033[0m"
# What a line begins with -> how it is shown: notices, and the headings of a verdict.
_BEGINNINGS = (
    (r"host: ", _YELLOW),
    (r"Known from this flight:", _BOLD),
    (r"  (?:good|tiny)\b", _GREEN),
    (r"  fair\b", _YELLOW),
    (r"(?:Finding|Note):", _YELLOW),
    (r"(?:  n|N)ot known\b", _RED),
    (r"(?:Fly next|Measure):", _BOLD),
    (r"(?:losses|stuck|saturated) +(?!none)\S", _RED),
    (r"(?:longitudinal|lateral|coefficients)\b[^:]*:", _BOLD),
)
_LINE = re.compile("|".join(f"^({begin})" for begin, _ in _BEGINNINGS), re.MULTILINE)


def coloured(stream: TextIO) -> bool:
    """Return whether what goes to a stream may be coloured."""
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb" or not stream.isatty():
        return False
    # Windows Terminal obeys codes; an old console window shows them.
    return sys.platform != "win32" or "WT_SESSION" in os.environ


def painted(text: str) -> str:
    """Return lines with the beginnings of some of them in colour."""

    def paint(found: re.Match[str]) -> str:
        number = found.lastindex or 1
        return f"{_BEGINNINGS[number - 1][1]}{found.group()}{_END}"

    return _LINE.sub(paint, text)
