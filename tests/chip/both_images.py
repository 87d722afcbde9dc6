"""Which image flies which case: each in turn, and in the campaign every one by every other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from compilers import TESTED


def each_image_once(cases: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Return every image with every case; those of a compiler out of turn are the campaign's."""
    return [
        pytest.param(
            image, *case, marks=[] if TESTED[at % len(TESTED)] == image else [pytest.mark.campaign]
        )
        for at, case in enumerate(cases)
        for image in TESTED
    ]
