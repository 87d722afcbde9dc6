"""Count the words of pages by group, lines that are too long and cells that say too much."""

from __future__ import annotations

import fnmatch
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINE_CHARACTERS = 160
CELL_WORDS = 25

# The first pattern that fits a page names its group.
GROUPS = (
    ("apart", ("*LICENSE*.md", "CHANGELOG.md")),
    ("generated", ("*/generated/*.md",)),
    ("user", ("README.md", "START.md", "HELP.md", "host/*.md", "hw/calibration/*.md")),
    ("user", ("hw/build.md", "hw/install.md", "hw/bring-up.md")),
    ("studies", ("host/studies/*.md",)),
    ("tests", ("tests/*.md",)),
    ("hw", ("hw/*.md",)),
    ("rooms", ("*.md",)),
)
NOT_WRITTEN_BY_HAND = {"apart", "generated"}


def group_of(page: str) -> str:
    """Name the group of a page, by its path from the top of the tree."""
    for name, patterns in GROUPS:
        for pattern in patterns:
            # A star of `host/*.md` stays in its folder, one of `tests/*.md` does not.
            deep = pattern.startswith("*") or name in {"tests", "hw"}
            if fnmatch.fnmatch(page, pattern) and (deep or pattern.count("/") == page.count("/")):
                return name
    raise ValueError(page)


def words_of(text: str) -> int:
    """Count each text between blanks that is no sign that draws a table, a list or a heading."""
    return sum(bool(word.strip("|-:#*`")) for word in text.split())


def lines_of_prose(text: str) -> Iterator[tuple[int, str]]:
    """Yield lines, with their number, that are neither code nor rows of a table."""
    fenced = False
    for number, line in enumerate(text.split("\n"), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced and not line.startswith("    ") and not line.lstrip().startswith("|"):
            yield number, line


def cells_of(text: str) -> Iterator[tuple[int, str]]:
    """Yield every cell of every table with the number of its line."""
    for number, line in enumerate(text.split("\n"), 1):
        if line.lstrip().startswith("|"):
            for cell in re.split(r"(?<!\\)\|", line.strip().strip("|")):
                yield number, cell


@dataclass(frozen=True)
class PageCount:
    """What one page holds: words, numbers of too long lines and of lines with too full cells."""

    page: str
    group: str
    words: int
    long_lines: tuple[int, ...]
    full_cells: tuple[int, ...]


def count_page(page: str, text: str) -> PageCount:
    """Count one page."""
    group = group_of(page)
    judged = group not in NOT_WRITTEN_BY_HAND
    long = [n for n, line in lines_of_prose(text) if judged and len(line) > LINE_CHARACTERS]
    full = [n for n, cell in cells_of(text) if judged and words_of(cell) > CELL_WORDS]
    return PageCount(page, group, words_of(text), tuple(long), tuple(full))


def tracked_pages(root: Path) -> list[str]:
    """Name the pages that git knows or would take."""
    command = ["git", "ls-files", "-co", "--exclude-standard", "*.md"]
    listed = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout
    return [name for name in sorted(set(listed.split("\n"))) if (root / name).is_file()]


def count_pages(root: Path = ROOT) -> list[PageCount]:
    """Count every page of the tree."""
    return [count_page(p, (root / p).read_text(encoding="utf-8")) for p in tracked_pages(root)]


def totals(counts: list[PageCount]) -> dict[str, int]:
    """Sum words by group but `apart`, all hand-written ones, long lines and full cells."""
    found = {name: 0 for name, _ in GROUPS if name != "apart"}
    for count in counts:
        if count.group in found:
            found[count.group] += count.words
    found["hand-written"] = sum(c.words for c in counts if c.group not in NOT_WRITTEN_BY_HAND)
    found["long lines"] = sum(len(c.long_lines) for c in counts)
    found["full cells"] = sum(len(c.full_cells) for c in counts)
    return found
