"""Rows of `neighbours.tsv`: frozen answers with half, and with twice a number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.ideas.effects import TOLERANCE, Again, effect
from tests.ideas.literals import Key
from tests.ideas.rows import NumberRow

TABLE = Path(__file__).parent / "neighbours.tsv"
WORSE = "half and double beside it: one at least is worse, none better (neighbours.tsv)"
NOTHING = "half and double beside it decide nothing (neighbours.tsv)"


@dataclass(frozen=True)
class Neighbours(NumberRow):
    """What half and twice a number do.

    Attributes
    ----------
    cases : int
        Frozen cases that were answered again.
    held, half_held, double_held : int
        Intervals that hold a known truth.
    half_score, double_score : float
        Sum of interval scores over the sum with the number as it is.
    """

    cases: int
    held: int
    half_held: int
    half_score: float
    double_held: int
    double_score: float

    @property
    def source(self) -> str:
        """What the scores say for the number; empty where no truth is known, or one is better."""
        scores = (self.half_score, self.double_score)
        if not self.held or min(scores) < 1.0 - TOLERANCE:
            return ""
        return WORSE if max(scores) > 1.0 + TOLERANCE else NOTHING


def neighbours(key: Key, half: Mapping[str, Again], double: Mapping[str, Again]) -> Neighbours:
    """Return the row of a number of what half and twice of it did to cases (`changed_answers`)."""
    less, more = (effect(key, len(found), found) for found in (half, double))
    return Neighbours(
        key.file, key.name, key.value, len(half), more.held_before,
        less.held, less.score, more.held, more.score,
    )  # fmt: skip
