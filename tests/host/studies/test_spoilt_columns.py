"""The study of spoilt columns: what is held, what is counted."""

import numpy as np
import pytest
from studies import spoilt_columns


def test_held_columns_repeat_and_keep_their_samples() -> None:
    columns = {name: np.arange(20.0) for name in ("t_s", "alpha_rad", "q_radps")}
    found = spoilt_columns.held(columns, ("alpha_rad",))
    assert list(found["alpha_rad"][:7]) == [0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 5.0]
    assert np.array_equal(found["q_radps"], columns["q_radps"])


def row(case: str, estimate: float, half_width: float) -> dict[str, str]:
    values = ("calm", 1, case, "aircraft", "Cm_q", -10.0, estimate, half_width)
    return dict(zip(spoilt_columns.COLUMNS, map(str, values), strict=True))


@pytest.mark.parametrize(
    ("estimate", "near", "hold"), [(-10.5, 100, 100), (-11.5, 100, 0), (-8.5, 0, 0)]
)
def test_estimates_are_judged_by_their_own_intervals(estimate: float, near: int, hold: int) -> None:
    """Near the unspoilt estimate of -10.5 is one thing, near the truth of -10 another."""
    rows = [row(spoilt_columns.UNSPOILT, -10.5, 0.7), row("held", estimate, 1.2)]
    [_, line] = spoilt_columns.table(rows)
    assert line.split()[-5:] == ["1", f"{near}.0", f"{hold}.0", "100.0", "1.71"]
