"""Parameters of an autopilot in the files that ground stations load and save.

Mission Planner: ``NAME,VALUE``, what follows a # is a comment (ExtLibs/Utilities/ParamFile.cs).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from host.control.control_error import ControlError
from host.files.user_text import read_text


@dataclass(frozen=True, slots=True)
class Change:
    """One parameter that tuning changes; `old` is None where nobody said it."""

    name: str
    new: float
    old: float | None
    unit: str


def read_parameters(path: Path) -> dict[str, float]:
    """Return the parameters of a file: name and value, apart by a comma, spaces or a tab.

    Lines of another shape are left out, as ground stations do.

    Raises
    ------
    ControlError
        No line is a parameter, or the file cannot be read.
    """
    text = read_text(path, ControlError, "parameters", encoding_errors="replace")
    found: dict[str, float] = {}
    for line in text.splitlines():
        words = re.split(r"[,\s]+", line.split("#")[0].strip())
        if len(words) != 2:
            continue
        try:
            value = float(words[1])
        except ValueError:
            continue
        if math.isfinite(value):
            found[words[0]] = value
    if not found:
        raise ControlError(
            f"{path}: no parameter, expected lines such as RLL_RATE_P,0.08: save them from the"
            " ground station"
        )
    return found


def parameter_text(changes: Iterable[Change], heading: Iterable[str]) -> str:
    """Return the new values as a file, the old one beside each."""
    lines = [f"# {line}" for line in heading]
    for one in changes:
        before = "not known" if one.old is None else f"{one.old:g}"
        lines.append(f"{one.name},{one.new:g}  # before: {before}")
    return "\n".join(lines) + "\n"


def restoring_text(changes: Iterable[Change], defaults: Mapping[str, float]) -> str:
    """Return the old values as a file; the autopilot's default where nobody said the old one."""
    lines = ["# back to the values before"]
    for one in changes:
        if one.old is None:
            lines.append(f"{one.name},{defaults[one.name]:g}  # the autopilot's default")
        else:
            lines.append(f"{one.name},{one.old:g}")
    return "\n".join(lines) + "\n"
