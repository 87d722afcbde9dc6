"""The table: a line for each world and group, limits that are missed marked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields

import numpy as np
from host.arrays import BoolArray

from studies.judgement.interval_score import Judged
from studies.judgement.judged_rows import MODE
from studies.judgement.scaled_figures import Figure, figures
from studies.judgement.worlds import WORLDS

SHARES = (
    "right, trust", "right, care", "right, refused", "wrong, trust", "wrong, care",
    "care, 10 to 30 % off", "refused", "missing",
)  # fmt: skip
RATIOS = ("relied on of right", "coverage", "honesty", "score")
MOST_WRONG, MOST_DISHONEST, COVERAGE = 5.0, 1.4, (90.0, 98.0)
GROUPS = {"nine principal": True, "all others": False}
MISSED = " !"


def lines(
    worlds: Mapping[str, Judged],
    scales: Mapping[str, Mapping[str, float]],
    cpu_s: Mapping[str, Sequence[float]],
) -> Iterator[str]:
    """Return the lines of the table of these worlds."""
    yield "| world | parameters | flights | " + " | ".join(SHARES) + " |"
    yield "| --- " * (3 + len(SHARES)) + "|"
    found: dict[tuple[str, str], dict[str, Figure]] = {}
    for world, own in worlds.items():
        for group, principal in GROUPS.items():
            mine = part(own, own.principal == principal)
            found[world, group] = figures(mine, scales.get(world, {}))
            cells = [_cell(world, principal, n, found[world, group][n]) for n in SHARES]
            flights = len(np.unique(own.flight))
            yield f"| {world} | {group} | {flights} | " + " | ".join(cells) + " |"
    yield "Shares of all parameters of all flights, %, with half of their 95 % interval."
    yield ""
    yield "| world | parameters | " + " | ".join(RATIOS) + " | s CPU a flight |"
    yield "| --- " * (3 + len(RATIOS)) + "|"
    for (world, group), own_figures in found.items():
        cells = [_cell(world, GROUPS[group], n, own_figures[n]) for n in RATIOS]
        spent = f"{np.median(cpu_s[world]):.1f}" if GROUPS[group] else ""
        yield f"| {world} | {group} | " + " | ".join(cells) + f" | {spent} |"
    for group in GROUPS:
        pooled = [found[w, group]["score"] for w in worlds if not WORLDS[w].apart]
        yield f"score of {group}, mean over {len(pooled)} worlds: {_mean(pooled)}"
    yield "A limit is missed (!) where it lies outside the 95 % interval."


def mode_lines(rows: Mapping[str, Sequence[Mapping[str, str]]]) -> Iterator[str]:
    """Return for each world how many intervals of each mode hold."""
    for world, own in rows.items():
        modes = [r for r in own if r["mark"] == MODE]
        parts = []
        for name in dict.fromkeys(r["name"] for r in modes):
            mine = [r for r in modes if r["name"] == name]
            off = [abs(float(r["estimate"]) - float(r["true"])) for r in mine]
            held = sum(x <= float(r["half_width"]) for x, r in zip(off, mine, strict=True))
            parts.append(f"{name} {held} of {len(mine)}")
        if parts:
            yield f"modes that hold, {world}: {'; '.join(parts)}"


def part(own: Judged, chosen: BoolArray) -> Judged:
    """Return some of the parameters."""
    return Judged(**{f.name: getattr(own, f.name)[chosen] for f in fields(own)})


def _cell(world: str, principal: bool, name: str, figure: Figure) -> str:
    return str(figure) + (MISSED if principal and _missed(world, name, figure) else "")


def _missed(world: str, name: str, figure: Figure) -> bool:
    """Return whether a limit of the principal derivatives is missed for certain."""
    least = WORLDS[world].least_relied
    if name == "wrong, trust":
        return figure.low > MOST_WRONG
    if name == "honesty":
        return figure.low > MOST_DISHONEST
    if name == "coverage":
        return figure.high < COVERAGE[0] or figure.low > COVERAGE[1]
    return name == "relied on of right" and least is not None and figure.high < least


def _mean(found: Sequence[Figure]) -> Figure:
    value = float(np.mean([f.value for f in found]))
    half = np.sqrt(np.sum([(0.5 * (f.high - f.low)) ** 2 for f in found])) / len(found)
    return Figure(value, value - float(half), value + float(half))
