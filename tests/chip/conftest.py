"""Finds the chip simulator and builds it; without libsimavr the tests fail, they do not skip."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parent / "simulator"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

from simavr_bench.fixtures import build, make_chip  # noqa: E402

__all__ = ["build", "make_chip"]
