"""Numbers that are said to tune nothing, drawn by seed and changed: no frozen answer may move.

Physics and what a specification fixes (`format` with a source) are not drawn: nobody chose them,
and another value reads a log wrongly.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence

from tests.ideas.classes import Row
from tests.ideas.literals import Key
from tests.ideas.sources import ROOT

STILL = ("format", "numerical", "presentation")
# A log of ours by coefficients, a table with aircraft file by both estimators, a user's model.
CASES = ("twin-log-coefficients", "trainer-pitch-aircraft", "users-linear-gust")
ALL_CASES = tuple(sorted(path.stem for path in (ROOT / "tests/answers/frozen").glob("*.json")))
TOGETHER = 6  # changed at once; where an answer moves, the half that moves it is sought


def drawn(keys: Sequence[Key], rows: Mapping[Key, Row], count: int, seed: int) -> list[Key]:
    """Draw numbers of the code that are classed as what moves no answer."""
    known = ((key, rows.get(key)) for key in sorted(keys))
    choice = [key for key, row in known if row and row.kind in STILL and not row.source]
    return random.Random(seed).sample(choice, min(count, len(choice)))
