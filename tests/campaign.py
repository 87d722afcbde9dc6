"""Cases that repeat others on another seed: some in every run, all before a release."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def every_nth(values: Iterable[Any], step: int) -> list[Any]:
    """Return all values; those between every n-th are the campaign's alone."""
    return [
        pytest.param(value, marks=[pytest.mark.campaign] if at % step else [])
        for at, value in enumerate(values)
    ]
