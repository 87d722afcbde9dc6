"""A reason against relying on parameters, whatever their interval says, and where it comes from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from host.sysid.checks.data_finding import Finding


@dataclass(frozen=True, slots=True)
class Doubt:
    """A reason, in one plain line, and the parameters that it concerns."""

    names: tuple[str, ...]
    reason: str


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence against an answer from outside of it.

    Attributes
    ----------
    findings : tuple of Finding
        Findings of the data checks.
    """

    findings: tuple[Finding, ...] = ()


def doubt(names: Iterable[str], order: Iterable[str], reason: str) -> list[Doubt]:
    """Return a doubt about some names in the order of the model; nothing about no name."""
    chosen = set(names)
    ordered = tuple(n for n in order if n in chosen)
    return [Doubt(ordered, reason)] if ordered else []


def reasons_by_name(doubts: Iterable[Doubt]) -> dict[str, tuple[str, ...]]:
    """Return each doubted name with all its reasons."""
    found: dict[str, tuple[str, ...]] = {}
    for one in doubts:
        for name in one.names:
            found[name] = (*found.get(name, ()), one.reason)
    return found
