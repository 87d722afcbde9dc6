"""Where a number acts, and what is said of an answer that it moves."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.ideas.effects import Effect, effect
from tests.ideas.literals import Key
from tests.ideas.number_users import users
from tests.ideas.rows import read_rows, write_rows
from tests.ideas.sources import modules

OWN = """from b import SHARED
LIMIT, SHARE = 0.3, 5
UNREAD = 7
class A:
    width = 9
    def f(self): return 11
def g():
    def inner(): return LIMIT
    return inner() * 13
def h(x=SHARED): return A.WIDE
"""
OTHER = """SHARED = 15
WIDE = 17
IN_KERNEL = 19
@compiled_fast
def kernel(): return IN_KERNEL
def k(): return SHARED
"""


def test_a_number_acts_where_it_stands_or_where_its_constant_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(OWN)
    (tmp_path / "b.py").write_text(OTHER)
    found = {key.value: places for key, places in users(modules(tmp_path).values()).items()}
    assert found["0.3"] == found["5"] == {"a:g"}
    assert found["13"] == {"a:g"}
    assert found["15"] == {"a:h", "b:k"}
    assert found["17"] == {"a:h"}
    # Nobody reads it, a class has it, a kernel does: it may act anywhere.
    assert not found.keys() & {"7", "9", "11", "19"}


def test_rows_are_read_as_they_were_written(tmp_path: Path) -> None:
    rows = [
        Effect("b", "f", "3", 16, 2, 0.25, "stuck: M_q 1 -> 2", 130, 129, 1.002),
        Effect("a.toml", "x.y", "0.1", 4, 0, 0.0, "", 0, 0, 1.0),
    ]
    write_rows(Effect, rows, tmp_path / "effects.tsv")
    assert read_rows(Effect, tmp_path / "effects.tsv") == {row.key: row for row in rows}
    assert next(iter(read_rows(Effect, tmp_path / "effects.tsv"))) == Key("a.toml", "x.y", "0.1")


def record(value: float, half: float, off: float) -> dict[str, object]:
    """Return an answer of one estimate with a known truth."""
    answer = {"template": "t", "method": "m", "estimates": {"M_q": [value, half]}}
    return {"answers": [answer], "off": {"t, m, M_q": off}}


KEY = Key("a", "f", "3")


def again(value: float, half: float, off: float) -> Effect:
    """Return the row of a number that makes this of 1 +- 0.5, off by half of that."""
    old, new = record(1.0, 0.5, 0.5), record(value, half, off)
    return effect(KEY, 7, {"stuck": {"old": old, "new": new, "lines": ["words"]}})


def test_a_score_counts_widths_and_misses() -> None:
    assert again(1.0, 0.6, 0.4).score == pytest.approx(1.2)
    missed = again(1.5, 0.5, 1.1)
    assert missed.score == pytest.approx((2.0 + 40.0 * 0.1) / 2.0)
    assert (missed.held_before, missed.held) == (1, 0)


def test_the_largest_movement_is_in_half_widths() -> None:
    found = again(1.1, 0.75, 0.5)
    assert (found.cases, found.moved, found.most) == (7, 1, 0.5)
    assert found.where.startswith("stuck: t, m, M_q 1 +- 0.5 -> 1.1")
    words = again(1.0, 0.5, 0.5)
    assert (words.moved, words.most, words.where) == (1, 0.0, "stuck: words")


def test_what_moves_nothing_has_an_empty_row() -> None:
    assert effect(KEY, 3, {}) == Effect("a", "f", "3", 3, 0, 0.0, "", 0, 0, 1.0)
