"""Where a number acts, and what is said of an answer that it moves."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.ideas.literals import Key
from tests.ideas.number_users import users
from tests.ideas.sensitivity import Effect, _largest, _scored, read, write
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
    write(rows, tmp_path / "effects.tsv")
    assert read(tmp_path / "effects.tsv") == {row.key: row for row in rows}
    assert next(iter(read(tmp_path / "effects.tsv"))) == Key("a.toml", "x.y", "0.1")


def record(value: float, half: float, off: float) -> dict[str, object]:
    """Return an answer of one estimate with a known truth."""
    answer = {"template": "t", "method": "m", "estimates": {"M_q": [value, half]}}
    return {"answers": [answer], "off": {"t, m, M_q": off}}


def test_a_score_counts_widths_and_misses() -> None:
    wider = _scored(record(1.0, 0.5, 0.5), record(1.0, 0.6, 0.4))
    assert wider["now"] / wider["before"] == pytest.approx(1.2)
    missed = _scored(record(1.0, 0.5, 0.5), record(1.5, 0.5, 1.1))
    assert missed["now"] / missed["before"] == pytest.approx((2.0 + 40.0 * 0.1) / 2.0)
    assert (missed["held_before"], missed["held"]) == (1, 0)


def test_the_largest_movement_is_in_half_widths() -> None:
    found = _largest(record(1.0, 0.5, 0.5), record(1.1, 0.75, 0.5), ["words"])
    assert found["most"] == pytest.approx(0.5)
    assert found["line"].startswith("t, m, M_q 1 +- 0.5 -> 1.1")
    words = _largest(record(1.0, 0.5, 0.5), record(1.0, 0.5, 0.5), ["words"])
    assert words == {"most": 0.0, "line": "words"}
