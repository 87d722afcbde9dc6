"""The truth that verdicts of test points are measured against: other airs, more near the limit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from host.twin.testcard.cards import Card, Segment
from numpy.typing import NDArray
from studies import point_verdicts

POINT = Segment("doublet", axes=("aileron",), amplitudes=(4.0,), width_s=0.6)


@pytest.mark.parametrize(("width", "flights"), [(1.0, 7), (1.25, 28), (1.35, 28), (1.7, 7)])
def test_a_point_near_the_limit_is_flown_in_more_airs(
    monkeypatch: pytest.MonkeyPatch, width: float, flights: int
) -> None:
    card = Card("card", "card", "ultrastick25e", (POINT,))
    flown: list[int] = []

    def fly(_: Card, seed: int, *, noise_seed: int) -> SimpleNamespace:
        assert seed == 16300
        flown.append(noise_seed)
        return SimpleNamespace(table=None)

    def ratios(*_: object) -> NDArray[np.float64]:
        # A fifth flight in which nobody finds the input changes no median.
        unfound = len(flown) == 5
        return np.full(2, point_verdicts.NEVER if unfound else width)

    monkeypatch.setattr(point_verdicts, "virtual_flight", fly)
    monkeypatch.setattr(point_verdicts, "_ratios", ratios)
    others = point_verdicts.in_other_airs(card, POINT, 16300)
    assert others.shape == (flights, 2)
    assert np.median(others, axis=0) == pytest.approx(width)
    assert len({*flown, 16300}) == flights + 1  # the point's own air is none of them


def test_how_often_two_logs_call_a_point_alike() -> None:
    assert point_verdicts._alike([True] * 8) == 1.0
    assert point_verdicts._alike([True, True, False, False]) == pytest.approx(2 / 6)
