"""Records without noise: what is flown, and what the table counts."""

from __future__ import annotations

import numpy as np
import pytest
from studies import clean_records


def test_a_held_input_drives_as_its_samples_say() -> None:
    """The smooth one of the same seed moves on between them."""
    true = clean_records.AIRCRAFT[1]
    held, smooth = (
        clean_records.flown(kind, true, 0.04, np.random.default_rng(3))
        for kind in ("smooth, held", "smooth")
    )
    np.testing.assert_allclose(held["elevator_rad"], smooth["elevator_rad"])
    late = np.abs(held["q_radps"] - smooth["q_radps"]).max() / np.ptp(smooth["q_radps"])
    assert 0.01 < late < 0.2


@pytest.mark.parametrize(("estimate", "held"), [(-13.0, 1), (-12.0, 0)])
def test_the_table_counts_what_holds(estimate: float, held: int) -> None:
    row = dict.fromkeys(clean_records.COLUMNS, "") | {
        "seed": "1",
        "input": "steps",
        "name": "M_de",
        "true": "-14",
        "estimate": str(estimate),
        "half_width": "1.4",
    }
    [_, steps, every] = clean_records.table([row])
    assert steps.split()[:5] == ["steps", "1", "1", str(held), "10.00"]
    assert every.split()[1:] == steps.split()[1:]
