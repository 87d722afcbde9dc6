"""Which known name somebody meant who wrote another."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def like(name: str, known: Iterable[str]) -> str:
    """Return in brackets which of the known names may have been meant; empty if none."""
    lower = {k.lower(): k for k in known}
    near = difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.6)
    return f" (did you mean {lower[near[0]]}?)" if near else ""
