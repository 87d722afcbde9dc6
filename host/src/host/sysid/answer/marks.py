"""What a parameter may be used for, in five marks, and the words that head them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

TRUST = 0.10  # 95 % half-width over value: good enough to design with
FAIR = 0.30
LARGEST_SHARE = 10.0  # that is printed
# Best first.
MARKS = TRUSTED, CAREFUL, SMALL, UNSURE, USELESS = (
    "trust", "use with care", "less than 5 % of the row", "do not rely on", "do not use",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Verdict:
    """What of one model may be relied on.

    Attributes
    ----------
    heading : str
        The model, its maneuvers and method.
    marks : dict
        Parameter to one of `MARKS`; what is neither derivative nor coefficient has none.
    lines : tuple of str
        The same in words, with the reasons and what to fly again; the heading is the first.
    reasons : dict
        Parameter to why it stands under its mark, a plain line each.
    """

    heading: str
    marks: dict[str, str]
    lines: tuple[str, ...]
    reasons: dict[str, tuple[str, ...]]


def names_marked(marks: Mapping[str, str], mark: str) -> list[str]:
    """Return the names under a mark."""
    return [name for name, own in marks.items() if own == mark]


def share_text(share: float, fair: float = FAIR) -> str:
    """Return a half-width's share in per cent, a decimal where it lies just beyond a limit."""
    if share >= LARGEST_SHARE:
        return f"> {100.0 * LARGEST_SHARE - 1.0:.0f} %"
    text = f"{100.0 * share:.0f}"
    beyond = any(share > limit and text == f"{100.0 * limit:.0f}" for limit in (TRUST, fair))
    return f"{100.0 * share:.1f} %" if beyond else f"{text} %"


def first_lines(heading: str, marks: Mapping[str, str], fair: float) -> list[str]:
    """Return the heading, then what is within a tenth and what within `fair` of its size."""
    trusted = ", ".join(names_marked(marks, TRUSTED))
    lines = [heading, f"  trust (within 10 %):  {trusted or 'nothing'}"]
    if careful := names_marked(marks, CAREFUL):
        lines.append(f"  use with care (10 to {100.0 * fair:.0f} %):  {', '.join(careful)}")
    return lines
