"""Surfaces between samples: what is flown, and what the table counts."""

from __future__ import annotations

import numpy as np
import pytest
from studies import surfaces_between_samples as study


def test_surfaces_move_between_samples_as_they_are_named() -> None:
    command = np.repeat([0.0, 1.0, 1.0], 20)
    held, lines, servo = (study.moved(motion, command, 20) for motion in ("held", "lines", "servo"))
    assert list(np.flatnonzero(np.diff(held))) == [19]
    assert lines[20] == pytest.approx(servo[20])
    assert lines[30] == pytest.approx(0.5 * (servo[20] + servo[40]))
    assert servo[40] == pytest.approx(1.0 - np.exp(-study.SERVO_RADPS * 0.02))


@pytest.mark.parametrize(("estimate", "held"), [(-15.9, 1), (-15.0, 0)])
def test_the_table_counts_what_holds(estimate: float, held: int) -> None:
    row = dict.fromkeys(study.COLUMNS, "") | {
        "seed": "1", "motion": "held", "rate_hz": "50", "true": "-16", "half_width": "0.4",
        "estimate": str(estimate), "hold": "zoh",
    }  # fmt: skip
    rows = [{**row, "name": name} for name in ("L_p", "L_da")]
    [_, line] = study.table(rows)
    assert line.split()[:5] == ["held", "50", "1", str(2 * held), "2"]
    assert line.split()[-1] == "1"
