"""The printed table: a figure, its limit, whether it was kept."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Table:
    """Prints rows as they come and remembers which limits were missed.

    Attributes
    ----------
    missed : list of str
        Names of the rows whose limit was not kept.
    """

    missed: list[str] = field(default_factory=list)

    def head(self, text: str) -> None:
        """Print a heading."""
        print(f"\n{text}", flush=True)

    def row(self, name: str, value: str, limit: str = "", *, ok: bool | None = None) -> None:
        """Print one figure; ``ok`` None: it has no limit."""
        verdict = "" if ok is None else ("ok" if ok else "MISSED")
        print(f"  {name:46} {value:>24}  {limit:24} {verdict}".rstrip(), flush=True)
        if ok is False:
            self.missed.append(name)

    def at_most(self, name: str, value: float, limit: float, unit: str, digits: int = 0) -> None:
        """Print a figure that may not be larger than a limit."""
        shown, most = f"{value:.{digits}f} {unit}", f"<= {limit:g} {unit}"
        self.row(name, shown, most, ok=value <= limit)

    def at_least(self, name: str, value: float, limit: float, unit: str) -> None:
        """Print a figure that may not be smaller than a limit."""
        self.row(name, f"{value:.0f} {unit}", f">= {limit:g} {unit}", ok=value >= limit)

    def none_of(self, name: str, count: int, of: int | None = None) -> None:
        """Print a count that should be zero."""
        shown = f"{count}" if of is None else f"{count} of {of}"
        self.row(name, shown, "none", ok=count == 0)
