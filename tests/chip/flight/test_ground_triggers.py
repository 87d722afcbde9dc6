"""The image on the chip starts no row on the ground, and an honest trigger starts its row."""

from __future__ import annotations

from pathlib import Path

import pytest
from flight.ground_triggers import GROUND, fly

from tests.sitl.ground_triggers import in_flight, on_the_ground

SEED = 46_300
FIRST = 6


@pytest.mark.parametrize("number", [GROUND[1], GROUND[2]])
def test_the_image_starts_no_row_on_the_ground(
    number: int, flight_elf: Path, tmp_path: Path
) -> None:
    told = fly(on_the_ground(number, SEED), flight_elf, tmp_path, FIRST)
    assert told.enabled
    assert sum(told.refused.values()) == FIRST
    assert (told.started, told.moved) == (0, 0)


def test_the_image_flies_an_honest_row_by_its_pitot_alone(flight_elf: Path, tmp_path: Path) -> None:
    told = fly(in_flight(0, SEED), flight_elf, tmp_path, FIRST)
    assert told.started == FIRST
    assert told.moved > 0
