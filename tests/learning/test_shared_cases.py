"""The logger's arithmetic: committed cases are current; what its integers and floats cost."""

from __future__ import annotations

import numpy as np
import pytest
from host.planning.onboard_sums import MOST_SAMPLES, AxisCard, FourierSums

from tests.learning.shared_cases import HEADER, Case, answer, every_case, header

SHARE_OF_HALF_WIDTH, SHARE_OF_WIDTH = 0.05, 0.02


def test_cases_of_the_firmware_are_current() -> None:
    assert HEADER.read_text(encoding="ascii") == header()


@pytest.mark.parametrize("case", every_case(), ids=lambda c: c.name)
def test_integers_and_single_floats_say_what_double_precision_says(case: Case) -> None:
    ours, exact = answer(case).solves, answer(case, double=True).solves
    assert len(ours) == len(exact) >= 1
    for (count, one), (other_count, other) in zip(ours, exact, strict=True):
        assert count == other_count
        told = other.half_width > 0.0
        assert np.array_equal(told, one.half_width > 0.0)
        apart = (one.estimate - other.estimate)[told] / other.half_width[told]
        assert np.abs(apart).max() <= SHARE_OF_HALF_WIDTH
        assert np.abs(one.half_width[told] / other.half_width[told] - 1.0).max() <= SHARE_OF_WIDTH


def test_the_worst_sum_of_60_s_fits_in_32_bits() -> None:
    pitch = next(c.card for c in every_case() if c.name == "Pitch")
    card = AxisCard(
        pitch.axis, (0,), pitch.advance_s, pitch.curvature_s2, pitch.lever, pitch.product,
        pitch.gain, pitch.tolerance, pitch.wanted_percent,
    )  # fmt: skip
    sums = FourierSums(card)
    sums.take([32767, -32768, 0])
    for _ in range(MOST_SAMPLES - 1):
        assert sums.take([-32768, 32767, 0])
    assert not sums.take([0, 0, 0])
    assert sums.sums.min() == -(MOST_SAMPLES - 1) * 2**19
    assert np.abs(sums.sums).max() < 2**31
