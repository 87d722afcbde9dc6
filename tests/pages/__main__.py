"""Print words of pages by group and their limits; `--fall` lowers these to today."""

from __future__ import annotations

import argparse
import sys
import tomllib
from pathlib import Path

from tests.pages.page_words import count_pages, totals

LIMITS = Path(__file__).with_name("limits.toml")
GENERATED_WORDS = 16_000
HEAD = (
    "# What pages may hold: the least that was reached. `python -m tests.pages --fall` lowers it."
)


def read_limits(file: Path = LIMITS) -> dict[str, int]:
    """Read the limit of every group."""
    return dict(tomllib.loads(file.read_text(encoding="utf-8"))["most"])


def write_limits(found: dict[str, int], limits: dict[str, int], file: Path = LIMITS) -> None:
    """Lower each limit to what was found; none rises. Generators are free below theirs.

    Words are rounded up to a hundred, so that a sentence put right needs no other one to go.
    """
    free = {"generated": limits.get("generated", GENERATED_WORDS)}
    room = {
        name: -(-count // 100) * 100 if count > 1000 else count for name, count in found.items()
    }
    lower = {name: min(limits.get(name, count), count) for name, count in room.items()} | free
    rows = [f'"{name}" = {count}' for name, count in lower.items()]
    file.write_text("\n".join([HEAD, "", "[most]", *rows, ""]), encoding="utf-8")


def main(arguments: list[str] | None = None) -> int:
    """Print the count; 6 where a group is above its limit."""
    parser = argparse.ArgumentParser(prog="python -m tests.pages", description=__doc__)
    parser.add_argument("--pages", action="store_true", help="each page, longest first")
    parser.add_argument("--fall", action="store_true", help="lower limits to today's counts")
    chosen = parser.parse_args(arguments)
    counts = count_pages()
    if chosen.pages:
        for c in sorted(counts, key=lambda c: -c.words):
            marks = f"{len(c.long_lines):4d} long {len(c.full_cells):4d} full"
            print(f"{c.words:6d} {marks}  {c.group:10s} {c.page}")
    found = totals(counts)
    if chosen.fall:
        write_limits(found, read_limits() if LIMITS.is_file() else {})
    limits = read_limits()
    for name, count in found.items():
        print(f"{name:14s} {count:7d}  of {limits[name]:7d}")
    return 6 if any(count > limits[name] for name, count in found.items()) else 0


if __name__ == "__main__":
    sys.exit(main())
