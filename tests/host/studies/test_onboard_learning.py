"""The study of the learning on the chip: its table counts, its solves begin each second."""

from __future__ import annotations

import numpy as np
from studies.onboard_learning import AFTER_S, COLUMNS, learned, table

from tests.learning.shared_cases import every_case


def row(seed: int, estimate: float, half_width: float) -> dict[str, str]:
    values = (seed, "pitch", AFTER_S[-1], "Cm_alpha", -1.5, estimate, half_width, -1.45, 0.2)
    return dict(zip(COLUMNS, map(str, (*values, "nan", "nan")), strict=True))


def test_the_table_counts_what_holds_and_what_is_apart_from_double_precision() -> None:
    lines = table([row(1, -1.46, 0.2), row(2, -1.2, 0.21)])
    assert " 1/2 " in lines[1]
    assert "1 of 2 intervals hold the truth (50.0 %)" in lines[2]
    assert "1.2500 half-widths and 5.00 %" in lines[2]


def test_a_solve_begins_each_second_from_the_second_one_on() -> None:
    case = every_case()[0]
    found = learned(case.card, case.rows, double=False)
    assert list(found) == [2, 3, 4, 5, 6]
    widths = np.array([one.half_width for one in found.values()])
    assert (widths > 0.0).all()
