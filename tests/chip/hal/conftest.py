"""A chip that runs the probe with the board's own hal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from simavr_bench import Chip

MakeProbe = Callable[[], "Chip"]


@pytest.fixture
def make_probe() -> Iterator[MakeProbe]:
    """A maker of powered chips that run the probe; closes them afterwards."""
    from hal.build_probe import build_probe
    from simavr_bench import Chip

    chips: list[Chip] = []

    def make() -> Chip:
        chip = Chip(startup_s=0.0)
        chips.append(chip)
        chip.load(build_probe())
        chip.power_on()
        chip.run_s(0.02)
        return chip

    yield make
    for chip in chips:
        chip.close()
