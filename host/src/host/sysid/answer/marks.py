"""What a parameter may be used for, in five marks, and the table of rules that gives them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from host.constants import CARE_SHARE, TRUST_SHARE

LARGEST_SHARE = 10.0  # that is printed
# Best first.
MARKS = TRUSTED, CAREFUL, SMALL, UNSURE, USELESS = (
    "trust", "use with care", "less than 5 % of the row", "do not rely on", "do not use",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Judged:
    """One estimate as the rules of the marks read it, whatever estimated it.

    Attributes
    ----------
    name : str
    share : float
        95 % half-width over what it is judged against.
    against : tuple of str
        What speaks against it besides its width, a plain line each.
    small : bool
        Less than 5 % of its row, and known to be so.
    """

    name: str
    share: float
    against: tuple[str, ...] = ()
    small: bool = False


# Mark to what it needs of an estimate; the first holds.
MARK_RULES: tuple[tuple[str, Callable[[Judged], bool]], ...] = (
    (USELESS, lambda one: not one.share <= 1.0),
    (UNSURE, lambda one: bool(one.against) or one.share > CARE_SHARE),
    (SMALL, lambda one: one.small),
    (CAREFUL, lambda one: one.share > TRUST_SHARE),
    (TRUSTED, lambda one: True),
)


def mark_of(one: Judged) -> str:
    """Return the mark of an estimate."""
    return next(mark for mark, holds in MARK_RULES if holds(one))


@dataclass(frozen=True, slots=True)
class Verdict:
    """Verdict on one model: what of it may be relied on.

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


def share_text(share: float) -> str:
    """Return a half-width's share in per cent, a decimal where it lies just beyond a limit."""
    if share >= LARGEST_SHARE:
        return f"> {100.0 * LARGEST_SHARE - 1.0:.0f} %"
    text = f"{100.0 * share:.0f}"
    beyond = any(
        share > limit and text == f"{100.0 * limit:.0f}" for limit in (TRUST_SHARE, CARE_SHARE)
    )
    return f"{100.0 * share:.1f} %" if beyond else f"{text} %"


def percent(share: float) -> str:
    """Return a share for people; a simulation that diverges has none."""
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else "none, it diverges"
