"""Make the page of hazards from hazards.toml; `--check` proves that it is current."""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
TABLE = HERE / "hazards.toml"
PAGE = HERE / "generated" / "HAZARDS.md"
FIRST_LINE = "<!-- made by hw/generate_hazards.py from hw/hazards.toml; do not edit -->"
GROUPS = {"C": "The pilot's control", "R": "The recording"}
INTRODUCTION = """\
What may happen to the pilot's control and to the recording, what notices it, what bounds it, and
the test that shows so. **Simulation only**: the last line of each row says what nobody knows before
a bench has measured it (`bring-up.md` says how).

A name behind `tests/chip/flight/faults` is a row of `make faults`; one behind a `.cpp` is a case of
`make native`; all others are pytest's.
"""


class HazardError(Exception):
    """A row is incomplete or stands twice; the text says which."""


@dataclass(frozen=True, slots=True)
class Hazard:
    """One row."""

    id: str
    hazard: str
    cause: str
    effect: str
    detected: str
    limited: str
    shown_by: tuple[str, ...]
    bench: str


def load(text: str) -> list[Hazard]:
    """Read the table.

    Raises
    ------
    HazardError
        If a field is missing, empty or unknown, an id stands twice or belongs to no group, or a
        row names no test.
    """
    fields = set(Hazard.__dataclass_fields__)
    found: dict[str, Hazard] = {}
    for row in tomllib.loads(text)["hazard"]:
        name = row.get("id", "a row without id")
        if set(row) != fields:
            raise HazardError(f"{name}: found {sorted(row)}, expected {sorted(fields)}")
        empty = sorted(key for key, value in row.items() if not value)
        if empty:
            raise HazardError(f"{name}: {', '.join(empty)} is empty")
        if name in found or name[0] not in GROUPS or not name[1:].isdigit():
            raise HazardError(f"{name}: expected an id of its own, C or R and a number")
        found[name] = Hazard(**{**row, "shown_by": tuple(row["shown_by"])})
    return list(found.values())


def page(hazards: list[Hazard]) -> str:
    """Write the page that people read."""
    return "\n".join([FIRST_LINE, *_lines(hazards)]) + "\n"


def _lines(hazards: list[Hazard]) -> Iterator[str]:
    yield "# Hazards"
    yield ""
    yield from INTRODUCTION.splitlines()
    for letter, title in GROUPS.items():
        rows = [hazard for hazard in hazards if hazard.id[0] == letter]
        yield ""
        yield f"## {title}: {len(rows)}"
        for hazard in rows:
            yield from _row(hazard)


def _row(hazard: Hazard) -> Iterator[str]:
    yield ""
    yield f"### {hazard.id} {hazard.hazard}"
    yield ""
    yield "| | |"
    yield "| --- | --- |"
    yield f"| cause | {hazard.cause} |"
    yield f"| effect | {hazard.effect} |"
    yield f"| detected | {hazard.detected} |"
    yield f"| limited | {hazard.limited} |"
    yield f"| shown by | {'<br>'.join(f'`{name}`' for name in hazard.shown_by)} |"
    yield f"| only a bench | {hazard.bench} |"


def main() -> int:
    """Write or check the page; 1 if it is not current, 2 if the table cannot be used."""
    parser = argparse.ArgumentParser(prog="hw/generate_hazards.py", description=__doc__)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    asked = parser.parse_args()
    try:
        text = page(load(TABLE.read_text(encoding="utf-8")))
    except (HazardError, tomllib.TOMLDecodeError) as error:
        print(f"hazards.toml: {error}", file=sys.stderr)
        return 2
    if asked.check:
        if PAGE.is_file() and PAGE.read_text(encoding="utf-8") == text:
            return 0
        print(f"{PAGE.name} is not current; run: python hw/generate_hazards.py", file=sys.stderr)
        return 1
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
