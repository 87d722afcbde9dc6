"""Cards of `make card-images` with which something was wrong on the chip alone."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest


@pytest.mark.parametrize(
    "seed", [pytest.param(33, id="ground known in a busy turn, an open file is closed: 3.7 ms")]
)
def test_the_heartbeat_notices_nothing(flight_elf: Path, tmp_path: Path, seed: int) -> None:
    from flight.card_flight import fly_beside
    from simavr_bench import in_fork

    from tests.cards.drawn import draw

    card = draw(seed).card
    assert in_fork(partial(fly_beside, flight_elf, card, tmp_path)).judgement.wrong == []
