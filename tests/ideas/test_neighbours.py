"""What half and twice a number say for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.ideas.classes import read as read_classes
from tests.ideas.literals import Key
from tests.ideas.neighbours import NOTHING, TABLE, WORSE, Neighbours, neighbours
from tests.ideas.rows import read_rows, write_rows
from tests.ideas.test_effects import record


def row(half: float, double: float) -> Neighbours:
    """Return a row with these scores."""
    return Neighbours("a", "f", "3", 4, 10, 10, half, 10, double)


@pytest.mark.parametrize(("half", "double", "source"), [
    (1.2, 1.0, WORSE), (0.995, 1.02, WORSE), (1.005, 0.995, NOTHING), (0.9, 1.3, ""),
])  # fmt: skip
def test_a_number_stands_where_neither_neighbour_is_better(
    half: float, double: float, source: str
) -> None:
    assert row(half, double).source == source
    assert replace(row(half, double), held=0).source == ""  # no truth is known


def test_a_row_is_made_of_what_both_do_and_read_as_written(tmp_path: Path) -> None:
    old = record(1.0, 0.5, 0.5)
    half = {"stuck": {"old": old, "new": record(1.0, 0.6, 0.4), "lines": ["words"]}}
    double = {"stuck": {"old": old, "new": record(1.5, 0.5, 1.1), "lines": ["words"]}}
    made = neighbours(Key("a", "f", "3"), half, double)
    assert (made.cases, made.held, made.half_held, made.double_held) == (1, 1, 1, 0)
    assert (made.half_score, made.double_score) == pytest.approx((1.2, 3.0))
    write_rows(Neighbours, [made], tmp_path / "neighbours.tsv")
    assert read_rows(Neighbours, tmp_path / "neighbours.tsv") == {made.key: made}


def test_a_source_that_names_neighbours_says_what_their_row_says() -> None:
    rows = read_rows(Neighbours, TABLE)
    for key, known in read_classes().items():
        if known.source in (WORSE, NOTHING):
            assert rows[key].source == known.source, key
