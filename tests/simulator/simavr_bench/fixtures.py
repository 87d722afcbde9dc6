"""Fixtures of pytest for tests that run programs on the simulated chip."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from simavr_bench.chip import Chip
from simavr_bench.testing import MakeChip

ROOM = Path(__file__).resolve().parents[1]


def _build_script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("simavr_bench_build", ROOM / "build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def build() -> ModuleType:
    """The build script, after it made the library."""
    module = _build_script()
    module.build_library()
    return module


@pytest.fixture
def make_chip(build: ModuleType) -> Iterator[MakeChip]:
    """A maker of powered chips that run a program of ``programs/``; closes them afterwards."""
    chips: list[Chip] = []

    def make(program: str, *, power: bool = True, seed: int = 1, startup_s: float = 0.0) -> Chip:
        chip = Chip(seed=seed, startup_s=startup_s)
        chips.append(chip)
        chip.load(build.build_program(program))
        if power:
            chip.power_on()
        return chip

    yield make
    for chip in chips:
        chip.close()
