"""Numbers of a page, each with the place in `result.json` it was taken from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from host.report.html_text import escaped

NOTHING = "\u2013"


@dataclass(frozen=True, slots=True)
class JsonNumbers:
    """A document of plain data whose numbers are shown.

    Attributes
    ----------
    document : dict
        What ``host identify --json`` prints.
    file : str
        File name under which the page holds it.
    """

    document: dict[str, Any]
    file: str = "result"

    def value(self, *path: str | int) -> Any:
        """Return the value at a place of the document, None without one."""
        found: Any = self.document
        for step in path:
            if isinstance(found, dict):
                found = found.get(step)
            elif isinstance(found, list) and isinstance(step, int) and step < len(found):
                found = found[step]
            else:
                return None
        return found

    def html(self, *path: str | int, digits: int = 4, scale: float = 1.0) -> str:
        """Return a number with its JSON pointer (RFC 6901), to so many significant digits.

        Parameters
        ----------
        *path : str or int
            Keys and places from the document's root on.
        digits : int
        scale : float
            Factor to the unit shown.
        """
        found = self.value(*path)
        if not isinstance(found, int | float) or isinstance(found, bool):
            return NOTHING
        steps = (str(step).replace("~", "~0").replace("/", "~1") for step in path)
        pointer = escaped("".join(f"/{step}" for step in steps))
        factor = "" if scale == 1.0 else f' data-scale="{scale!r}"'
        own = "" if self.file == "result" else f' data-file="{escaped(self.file)}"'
        return f'<span data-json="{pointer}"{own}{factor}>{found * scale:.{digits}g}</span>'
