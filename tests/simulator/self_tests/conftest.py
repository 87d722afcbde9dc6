"""Builds the simulator before its tests; without libsimavr they fail, they do not skip."""

from __future__ import annotations

import sys
from pathlib import Path

ROOM = Path(__file__).resolve().parents[1]
if str(ROOM) not in sys.path:
    sys.path.insert(0, str(ROOM))  # the package lies next to its tests, not in the host's wheel

from simavr_bench.fixtures import build, make_chip  # noqa: E402

__all__ = ["build", "make_chip"]
