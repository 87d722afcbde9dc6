"""Limits of the checks: `limits.toml` has them all."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

TABLE = Path(__file__).with_name("limits.toml")


@cache
def limits(item: str) -> dict[str, float]:
    """Return the limits of an item by name; each name ends in its unit."""
    tables = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return {name: float(value) for name, value in tables[item].items() if name != "why"}
