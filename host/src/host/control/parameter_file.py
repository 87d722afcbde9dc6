"""Parameters of an autopilot in the files that ground stations load and save.

Mission Planner: ``NAME,VALUE`` and nothing behind it, or the line is skipped; comments are lines of
their own (ExtLibs/Utilities/ParamFile.cs 2f6c1d7; MAVProxy the same, pymavlink/mavparm.py 036b8ac).
QGroundControl: vehicle, component, name, value and type between tabs (developer guide, parameter
file). INAV: lines of its command line, ``set name = value`` (docs/Cli.md). The
logger: TOML, whose heading is keys; elsewhere it is comments.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from host.control.control_error import ControlError
from host.files.user_text import read_text

FLOAT = 9  # MAV_PARAM_TYPE_REAL32
# One line of each: the name and the value.
NAMED = r"([A-Za-z]\w*)"
LINES = tuple(
    re.compile(pattern)
    for pattern in (
        rf"{NAMED}[,\s]+(\S+)",
        rf"\d+\t\d+\t{NAMED}\t(\S+)\t\d+",
        rf"(?:set )?{NAMED} = (\S+)",
    )
)


@dataclass(frozen=True, slots=True)
class Change:
    """One parameter that tuning changes; `old` is None where nobody said it."""

    name: str
    new: float
    old: float | None
    unit: str

    @property
    def before(self) -> str:
        """The old value as a comment has it."""
        return f"before: {'not known' if self.old is None else f'{self.old:g}'}"


Heading = Mapping[str, str | float]
Writer = Callable[[Iterable[Change], Heading], str]


def read_parameters(path: Path) -> dict[str, float]:
    """Return the parameters of a file of any of the three.

    Lines of another shape are left out, as ground stations do.

    Raises
    ------
    ControlError
        No line is a parameter, or the file cannot be read.
    """
    text = read_text(path, ControlError, "parameters", encoding_errors="replace")
    found: dict[str, float] = {}
    for line in text.splitlines():
        bare = line.split("#")[0].strip()
        matched = next((m for one in LINES if (m := one.fullmatch(bare))), None)
        if matched is None:
            continue
        try:
            value = float(matched[2])
        except ValueError:
            continue
        if math.isfinite(value):
            found[matched[1]] = value
    if not found:
        raise ControlError(
            f"{path}: no parameter, expected lines such as RLL_RATE_P,0.08: save them from the"
            " ground station"
        )
    return found


def _comments(heading: Heading) -> list[str]:
    return [f"# {key}: {value}" for key, value in heading.items()]


def mission_planner_text(changes: Iterable[Change], heading: Heading) -> str:
    """Return new values as Mission Planner loads them, the old one above each."""
    lines = _comments(heading)
    for one in changes:
        lines += [f"# {one.name} {one.before}", f"{one.name},{one.new:g}"]
    return "\n".join(lines) + "\n"


def qgroundcontrol_text(changes: Iterable[Change], heading: Heading) -> str:
    """Return new values as QGroundControl loads them, the old ones in comments above."""
    changes = tuple(changes)
    lines = _comments(heading)
    lines += [f"# {one.name} {one.before}" for one in changes]
    lines += [f"1\t1\t{one.name}\t{one.new:g}\t{FLOAT}" for one in changes]
    return "\n".join(lines) + "\n"


def cli_text(changes: Iterable[Change], heading: Heading) -> str:
    """Return new values as lines for INAV's command line; gains are of the active profile."""
    changes = tuple(changes)
    lines = _comments(heading)
    for one in changes:
        lines += [f"# {one.name} {one.before}", f"set {one.name} = {one.new:g}"]
    return "\n".join([*lines, *(["save"] if changes else [])]) + "\n"


def toml_text(changes: Iterable[Change], heading: Heading) -> str:
    """Return gains of the logger's hold with their units, what they were made of in keys above."""
    # A string in JSON's quotes and escapes is one of TOML's.
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in heading.items()]
    lines += [f"{one.name} = {float(one.new)!r}  # {one.unit}" for one in changes]
    return "\n".join(lines) + "\n"


def taken_back(changes: Iterable[Change], defaults: Mapping[str, float]) -> tuple[Change, ...]:
    """Return the way back; the autopilot's default where nobody said the old value."""
    return tuple(
        Change(one.name, defaults[one.name] if one.old is None else one.old, one.new, one.unit)
        for one in changes
    )
