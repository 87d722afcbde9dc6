"""What several methods say of one model, side by side, as wide as the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer

NAME, CELL = 14, 22  # characters: three methods in 80, four in 120


def method_table(answers: Sequence[Answer], width: int) -> list[str]:
    """Return estimates and 95 % half-widths, a column for each method.

    Parameters
    ----------
    answers : sequence of Answer
        Answers of any models and methods.
    width : int
        Characters of a line; methods that find no room follow below.
    """
    lines: list[str] = []
    for template in dict.fromkeys(a.template for a in answers):
        mine = [a for a in answers if a.template == template]
        room = max(1, (width - NAME) // CELL)
        for first in range(0, len(mine), room):
            lines += ["", *_block(template, mine[first : first + room])]
    return [*lines[1:], "  * refused or without convergence; - on a bound or left out: no interval"]


def _block(template: str, answers: Sequence[Answer]) -> list[str]:
    heads = [textwrap.wrap(a.method, CELL - 1) for a in answers]
    depth = max(len(head) for head in heads)
    lines = []
    for row in range(depth):
        cells = [head[row] if row < len(head) else "" for head in heads]
        label = template if row == 0 else ""
        lines.append(
            f"{label:{NAME}.{NAME - 1}s}" + "".join(f"{cell:>{CELL - 1}s} " for cell in cells)
        )
    names = dict.fromkeys(p.name for a in answers for p in a.model.parameters)
    for name in names:
        lines.append(f"  {name:{NAME - 2}s}" + "".join(_cell(a, name) for a in answers))
    return [line.rstrip() for line in lines]


def _cell(answer: Answer, name: str) -> str:
    result = answer.result
    if name not in result.names:
        return " " * CELL
    k = result.index(name)
    half = float(result.half_width()[k])
    wide = f"{half:.2g}" if half > 0.0 else "-"
    poor = not result.converged or name in {r.name for r in answer.identifiability_flags}
    return f"{result.estimate[k]:10.4g} +- {wide:>7s}{'*' if poor else ' '}"
