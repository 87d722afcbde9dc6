"""A cache of compiled kernels that is of other code, or cut short, costs time and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

KERNEL = """
import sys
import numpy as np
from host.compiled import compiled

@compiled
def double(x):
    return 2.0 * x

print(double(21.0), len(double.stats.cache_hits), len(double.stats.cache_misses))
"""


def run(folder: Path) -> str:
    """Call the kernel in a process of its own; give what it printed."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, str(folder / "kernel.py")],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("damage", ["index of a module that moved", "cut index", "cut code"])
def test_kernel_is_compiled_anew(tmp_path: Path, damage: str) -> None:
    (tmp_path / "kernel.py").write_text(KERNEL)
    assert run(tmp_path) == "42.0 0 1"
    assert run(tmp_path) == "42.0 1 0"
    (index,) = (tmp_path / "cache").rglob("*.nbi")
    (code,) = (tmp_path / "cache").rglob("*.nbc")
    if damage == "cut code":
        code.write_bytes(code.read_bytes()[:40])
    elif damage == "cut index":
        # Version and stamp stay whole; the table of signatures behind them does not.
        index.write_bytes(index.read_bytes()[:-20])
    else:
        moved = index.read_bytes().replace(b"numba.core.types.scalars", b"numba.core.types.sca1ars")
        assert moved != index.read_bytes()
        index.write_bytes(moved)
    assert run(tmp_path) == "42.0 0 1"
    assert run(tmp_path) == "42.0 1 0"
