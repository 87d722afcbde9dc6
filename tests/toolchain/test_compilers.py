"""The compiler at work is one the image is tested with, or the build says so and stops."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import compilers
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("wanted", compilers.TESTED)
def test_each_tested_compiler_is_there_and_says_its_version(wanted: str) -> None:
    folder = compilers.folder(wanted)
    assert folder is not None
    assert compilers.version(str(folder / "avr-gcc"), {}) == wanted


@pytest.mark.parametrize(
    ("found", "wanted", "wrong"),
    [
        ("5.4.0", "", False),
        ("7.3.0", "", False),
        ("7.3.0", "7.3.0", False),
        ("14.2.0", "any", False),
        ("14.2.0", "", True),
        ("5.4.0", "7.3.0", True),
        ("", "", True),
    ],
)
def test_another_version_is_told(found: str, wanted: str, wrong: bool) -> None:
    told = compilers.complaint(found, wanted)
    assert bool(told) == wrong
    assert "\n" not in told


def test_an_unknown_choice_and_a_missing_compiler_are_errors(tmp_path: Path) -> None:
    with pytest.raises(compilers.CompilerError, match=r"expected one of 5\.4\.0, 7\.3\.0, any"):
        compilers.folder("12")
    with pytest.raises(compilers.CompilerError, match="cannot be run"):
        compilers.version(str(tmp_path / "avr-gcc"), {})


def test_a_build_by_another_compiler_than_asked_for_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The build asks the compiler itself: one that only stands in the right place is found out."""
    real = compilers.folder("7.3.0")
    assert real is not None
    (tmp_path / "avr-gcc").symlink_to(real / "avr-gcc")
    monkeypatch.setenv("PATH", f"{tmp_path}:{Path(sys.executable).parent}:/usr/bin:/bin")
    monkeypatch.setenv("AVR_GCC", "5.4.0")
    monkeypatch.setenv("PLATFORMIO_BUILD_DIR", str(tmp_path / "build"))
    pio = Path(sys.executable).with_name("pio")
    done = subprocess.run(
        [pio, "run", "-e", "arduimu"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "found avr-gcc 7.3.0, expected 5.4.0" in done.stderr
    assert "Compiling" not in done.stdout
