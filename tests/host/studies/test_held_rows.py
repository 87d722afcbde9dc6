"""The table of rows that hold against rows that do not: pairs, refusals and signs."""

from __future__ import annotations

from studies.demonstration import PRINCIPAL
from studies.held_rows import COLUMNS, FIRST_SEED, GUSTS_MPS, card, table


def row(held: int, seed: int, error: float, *, told: bool = True) -> dict[str, str]:
    value = (0.5, seed, held, 6 - held, PRINCIPAL[0], 4.0, 4.0 * (1 + error), 0.4)
    found = {name: str(x) for name, x in zip(COLUMNS, value, strict=True)}
    return found if told else found | {"true": "", "estimate": "", "half_width": ""}


def test_each_air_is_counted_with_and_without_and_refusals_stay_out() -> None:
    rows = [row(0, 1, 0.05), row(0, 2, -0.15), row(1, 1, 0.05), row(1, 2, 0.05, told=False)]
    lines = table(rows)
    # Half-widths are a tenth: half of the first hold, and the second is 1.5 of them off.
    assert lines[1].split()[:6] == ["0.5", "0", "2", "6.00", "2", "50.0"]
    assert lines[2].split()[:6] == ["0.5", "1", "2", "5.00", "1", "100.0"]
    # Score of 95 %: the whole width, and 40 times what is outside: 0.2, and 0.2 + 2.
    assert lines[1].endswith("(mean 120.0)")
    assert lines[2].endswith("(mean 20.0)")
    (signs,) = (line for line in lines if line.startswith(PRINCIPAL[0]))
    assert signs.split()[1:4] == ["-0.50", "+-", "0.71"]


def test_a_pair_differs_by_the_hold_alone_and_each_air_has_its_own_card() -> None:
    assert [card(g).air.turbulence_mps for g in GUSTS_MPS] == list(GUSTS_MPS)
    kinds = [segment.kind for segment in card(0.0).segments]
    assert kinds == ["3211", "doublet", "doublet"] * 2 + ["trim"]
    assert FIRST_SEED > 8
