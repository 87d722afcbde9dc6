"""Numbers that are said to tune nothing, drawn by seed and changed: no frozen answer may move.

Physics and what a specification fixes (`format` with a source) are not drawn: nobody chose them,
and another value reads a log wrongly.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from tests.ideas.classes import Row
from tests.ideas.literals import Key
from tests.ideas.sources import ROOT

STILL = ("format", "numerical", "presentation")
# A log of ours by coefficients, a table with aircraft file by both estimators, a user's model.
CASES = ("twin-log-coefficients", "trainer-pitch-aircraft", "users-linear-gust")
ALL_CASES = tuple(sorted(path.stem for path in (ROOT / "tests/answers/frozen").glob("*.json")))
TOGETHER = 6  # changed at once; where an answer moves, the half that moves it is sought
LONGEST_S = 900


@dataclass(frozen=True)
class Moved:
    """A number that moved an answer, and the first lines of what moved."""

    key: Key
    lines: tuple[str, ...]


def drawn(keys: Sequence[Key], rows: Mapping[Key, Row], count: int, seed: int) -> list[Key]:
    """Draw numbers of the code that are classed as what moves no answer."""
    known = ((key, rows.get(key)) for key in sorted(keys))
    choice = [key for key, row in known if row and row.kind in STILL and not row.source]
    return random.Random(seed).sample(choice, min(count, len(choice)))


def movers(keys: Sequence[Key], cases: Sequence[str] = CASES) -> Iterator[Moved]:
    """Change numbers together, and yield those that move an answer by themselves."""
    for start in range(0, len(keys), TOGETHER):
        yield from _within(keys[start : start + TOGETHER], cases)


def _within(keys: Sequence[Key], cases: Sequence[str]) -> Iterator[Moved]:
    lines = _moved(keys, cases)
    said = "moved" if lines else "nothing moves"
    print(f"  {said}: {', '.join(f'{k.file}:{k.name} {k.value}' for k in keys)}", flush=True)
    if lines and len(keys) == 1:
        yield Moved(keys[0], tuple(lines))
    elif lines:
        half = len(keys) // 2
        yield from _within(keys[:half], cases)
        yield from _within(keys[half:], cases)


def _moved(keys: Sequence[Key], cases: Sequence[str]) -> list[str]:
    asked = {"keys": [[key.file, key.name, key.value] for key in keys], "cases": list(cases)}
    command = [sys.executable, "-m", "tests.ideas.changed"]
    try:
        done = subprocess.run(
            command, cwd=ROOT, input=json.dumps(asked), capture_output=True, text=True,
            timeout=LONGEST_S, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return [f"no answer in {LONGEST_S} s"]
    if done.returncode:
        return [f"stopped with {done.returncode}: {done.stderr.strip()[-200:]}"]
    found = json.loads(done.stdout.splitlines()[-1])["moved"]
    return [f"{case}: {line}" for case, lines in found.items() for line in lines]
