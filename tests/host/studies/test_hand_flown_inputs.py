"""A pilot's inputs in slow rows are found, and his handling is not: a few records of the study."""

from functools import lru_cache

import pytest
from host.arrays import Array
from studies.hand_flown import FlownByHand, decimated, flown
from studies.hand_flown_inputs import Score, add_record


@lru_cache(maxsize=1)
def records() -> list[tuple[dict[str, Array], list[FlownByHand]]]:
    """Return seven inputs of each aircraft, and ten minutes of handling."""
    with_inputs = [
        flown(plane, seed, inputs=7, length_s=300.0)
        for plane, seed in (("twin", 1), ("c172p", 2), ("737", 3))
    ]
    return [*with_inputs, flown("c172p", 9, inputs=0, length_s=600.0)]


@pytest.mark.costs(60, "fifteen minutes with inputs and ten of handling are flown once")
@pytest.mark.parametrize("rate_hz", [10.0, 5.0])
def test_inputs_by_hand_are_found_in_slow_rows(rate_hz: float) -> None:
    """At 10 Hz a lag of one row showed each edge in two halves: 20 % were missed."""
    score = Score()
    for columns, truth in records():
        add_record(score, decimated(columns, rate_hz), truth)
    assert score.flown == 21
    assert score.found >= 20
    assert score.false <= 1
