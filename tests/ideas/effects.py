"""Rows of `effects.tsv`: what a fifth more of a tuned number does to frozen answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.ideas.literals import Key
from tests.ideas.rows import NumberRow

TOLERANCE = 1e-2  # of a half-width, as between two machines: a search ends that near to its minimum
Again = dict[str, Any]  # a case: its frozen answer `old`, `new`, and `lines` of what moved
TABLE = Path(__file__).parent / "effects.tsv"
MISSED = 40.0  # 2 over 5 %: what a half-width outside costs (Gneiting & Raftery, JASA 102, 2007)
UNKNOWN = 1e3  # half-width of what the data say nothing about


@dataclass(frozen=True)
class Effect(NumberRow):
    """What a fifth more of a number does.

    Attributes
    ----------
    cases, moved : int
        Frozen cases that were answered again; of them those whose answer moved.
    most : float
        Largest movement of an estimate or of a half-width, in half-widths; 0 where words moved.
    where : str
        Case and text of that movement.
    held_before, held : int
        Intervals that hold a known truth in the cases that were answered for this number alone.
    score : float
        Sum of their interval scores over the sum before: below 1 the change is for the better.
    """

    cases: int
    moved: int
    most: float
    where: str
    held_before: int
    held: int
    score: float


def effect(key: Key, cases: int, found: Mapping[str, Again]) -> Effect:
    """Return the row of a number of what it alone did to cases.

    Parameters
    ----------
    key : Key
    cases : int
        Cases that were answered again, together with other numbers too.
    found : mapping
        By case (`changed_answers`).
    """
    moved = [(_largest(one), name) for name, one in found.items() if one["lines"]]
    (most, line), name = max(moved, default=((0.0, ""), ""))
    scores = [_scored(one["old"], one["new"]) for one in found.values()]
    before, now, held_before, held = (
        (sum(x) for x in zip(*scores, strict=True)) if scores else (0,) * 4
    )
    return Effect(
        key.file, key.name, key.value, cases, len(moved), round(most, 3),
        f"{name}: {line}".replace("\t", " ")[:160] if name else "",
        int(held_before), int(held), round(now / before, 4) if before else 1.0,
    )  # fmt: skip


def _estimates(record: Mapping[str, Any]) -> dict[str, Any]:
    return {
        f"{one['template']}, {one['method']}, {name}": pair
        for one in record.get("answers", ())
        for name, pair in one["estimates"].items()
    }


def _scored(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[float, float, int, int]:
    """Return interval scores in half-widths of the frozen answer and how many hold, old and new."""
    was, now = _estimates(old), _estimates(new)
    off, others = old.get("off", {}), new.get("off", {})
    both = [name for name in off if name in others and was[name][1] and now[name][1]]
    return (
        sum(_score(off[name]) for name in both),
        sum(now[name][1] / was[name][1] * _score(others[name]) for name in both),
        sum(x <= 1.0 for x in off.values()),
        sum(x <= 1.0 for x in others.values()),
    )


def _score(off: float) -> float:
    return 2.0 + MISSED * max(off - 1.0, 0.0)


def _largest(one: Again) -> tuple[float, str]:
    """Return the largest movement of an estimate or a half-width, else the first line."""
    most, line = 0.0, str(one["lines"][0])
    now = _estimates(one["new"])
    for name, (value, half) in _estimates(one["old"]).items():
        other, wide = now.get(name, (None, None))
        if None in (value, half, other, wide) or not 0.0 < half < UNKNOWN:
            continue
        by = max(abs(other - value), abs(wide - half)) / half
        if by > max(most, TOLERANCE):
            most, line = by, f"{name} {value:.4g} +- {half:.2g} -> {other:.4g} +- {wide:.2g}"
    return most, line
