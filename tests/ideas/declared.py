"""Functions that are declared doors, filters and the like, held against the syntax trees."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

DECLARED = Path(__file__).parent / "declared.toml"


@dataclass(frozen=True)
class Kind:
    """Functions of one kind, as FILE:NAME.

    Attributes
    ----------
    found : tuple of str
        Declared, and there.
    gone : tuple of str
        Declared under `names` or `others`, and not there.
    unseen : tuple of str
        Named like one, and not declared.
    """

    name: str
    found: tuple[str, ...]
    gone: tuple[str, ...]
    unseen: tuple[str, ...]

    @property
    def faults(self) -> list[str]:
        """Return a line for each name to correct."""
        said = {"is gone; take it out": self.gone, "is not declared; say what it is": self.unseen}
        return [f"{self.name}: {one} {why}" for why, names in said.items() for one in names]


def kinds(functions: Collection[str], declared: Path = DECLARED) -> dict[str, Kind]:
    """Return every kind of the declaration, looked up among the functions there are.

    Parameters
    ----------
    functions : collection of str
        Every function of the package, as FILE:NAME.
    declared : Path
        TOML of kinds: ``names``, ``others`` and the pattern ``like``.
    """
    found = {}
    for name, kind in tomllib.loads(declared.read_text(encoding="utf-8")).items():
        names, others = kind["names"], kind["others"]
        like = re.compile(kind["like"])
        unseen = {one for one in functions if like.search(one)} - {*names, *others}
        found[name] = Kind(
            name,
            tuple(one for one in names if one in functions),
            tuple(one for one in (*names, *others) if one not in functions),
            tuple(sorted(unseen)),
        )
    return found
