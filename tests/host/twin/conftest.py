"""The recorder as a shared library and as the Mega's image, built once per run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="session")
def library() -> Path:
    given = os.environ.get("HOST_SITL")
    if given:  # one built before
        return Path(given)
    built = subprocess.run(
        [sys.executable, str(ROOT / "firmware" / "toolchain" / "build_sitl.py")],
        capture_output=True, text=True, check=False, timeout=600,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    return Path(built.stdout.strip())


@pytest.fixture(scope="session")
def image() -> Path:
    path = ROOT / ".pio" / "build" / "mega2560" / "firmware.elf"
    if not path.is_file():
        pio = ROOT / ".venv" / "bin" / "pio"
        subprocess.run([str(pio), "run", "-e", "mega2560"], cwd=ROOT, check=True, timeout=600)
    return path
