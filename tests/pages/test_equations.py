"""The page of numbered equations and the code that computes them name each other."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "host" / "EQUATIONS.md"
SOURCES = ROOT / "host" / "src" / "host"
NUMBERED = re.compile(r"^\*\*\((\d+)\)")
LINK = re.compile(r"\]\(src/host/([\w/]+\.py)\)")
CITED = re.compile(r"eq\.\s+(?:#\s+)?(\d+)")


def on_the_page(text: str) -> set[tuple[int, str]]:
    """Numbers and the files that the page says compute them."""
    lines = [(NUMBERED.match(part), part) for part in text.split("\n\n")]
    return {(int(m.group(1)), file) for m, line in lines if m for file in LINK.findall(line)}


def in_the_code() -> set[tuple[int, str]]:
    """Numbers that sources cite, and these sources."""
    found = set()
    for path in SOURCES.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if PAGE.name in text:
            name = path.relative_to(SOURCES).as_posix()
            found |= {(int(number), name) for number in CITED.findall(text)}
    return found


def test_equations_are_numbered_in_their_order() -> None:
    text = PAGE.read_text(encoding="utf-8").split("\n")
    numbers = [int(m.group(1)) for m in map(NUMBERED.match, text) if m]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) > 30


def test_page_and_code_name_each_other() -> None:
    page, code = on_the_page(PAGE.read_text(encoding="utf-8")), in_the_code()
    assert page - code == set()
    assert code - page == set()


def test_a_citation_over_a_line_break_is_seen() -> None:
    assert CITED.findall("(EQUATIONS.md,\n    # eq. 2 and\neq. 14)") == ["2", "14"]
