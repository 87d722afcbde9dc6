"""The build says what is missing; it does not skip."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest


def test_missing_library_is_named(build: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "HEADER", Path("/nowhere/sim_avr.h"))
    with pytest.raises(build.BuildError, match="apt install libsimavr-dev"):
        build.build_library()


def test_missing_compiler_is_named(build: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(build.BuildError, match="apt install gcc-avr"):
        build.build_program("reset")


def test_library_leaves_the_debian_package_alone(build: ModuleType) -> None:
    # every symbol of simavr comes from the shared library of the package, none is compiled in
    import subprocess

    text = subprocess.run(
        ["readelf", "-d", build.LIBRARY], capture_output=True, text=True, check=True
    ).stdout
    assert "libsimavr.so" in text
