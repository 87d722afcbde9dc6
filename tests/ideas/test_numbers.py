"""Numbers found in code and TOML, their table, and what a changed one does."""

from __future__ import annotations

import ast
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from tests.ideas.changed import answers, change_numbers, changed
from tests.ideas.classes import Row, follow, missing, read, stale, write
from tests.ideas.drawn import drawn
from tests.ideas.literals import Key, code_literals, numbers, toml_literals
from tests.ideas.sources import modules


def found(text: str) -> list[tuple[str, str]]:
    """Return name and value of every number of a module."""
    return [(key.name, key.value) for key, _ in numbers(ast.parse(text), "a")]


def test_numbers_are_known_by_the_name_they_stand_under() -> None:
    text = """LIMIT, SHARE = 0.3, 5
class A:
    width: int = 7
    def f(self, x=2.5):
        def g():
            return -3.0 * x + 0.3
"""
    assert found(text) == [
        ("(LIMIT, SHARE)", "0.3"),
        ("(LIMIT, SHARE)", "5"),
        ("A.width", "7"),
        ("A.f", "2.5"),
        ("A.f.g", "-3.0"),
        ("A.f.g", "0.3"),
    ]


@pytest.mark.parametrize(
    "text",
    ["a = 0, 1, -1, 2, 2.0, True", "a[3], a[:-4]", "a**3", "np.zeros((3, 4))", "f(axis=3)",
     "a: Literal[7]", "'''7'''", "for k in range(3): pass", "[k for k in range(3)]"],
)  # fmt: skip
def test_plain_numbers_and_those_of_the_layout_are_left_out(text: str) -> None:
    assert found(text) == []


def test_attempts_are_no_layout() -> None:
    assert found("for _ in range(20): pass") == [("", "20")]


def test_one_number_twice_in_a_function_is_one_row(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("def f():\n    return 0.3 + 0.3, 3.5")
    literals = code_literals(modules(tmp_path).values())
    assert {key.value: len(one.nodes) for key, one in literals.items()} == {"0.3": 2, "3.5": 1}


def test_numbers_of_toml_have_their_place(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("[error.scale]\nsigma = [0.1, 2.0, 0.3]\non = true\n[[row]]\nx = 5\n")
    assert toml_literals([path]) == [
        Key("a.toml", "error.scale.sigma", "0.1"),
        Key("a.toml", "error.scale.sigma", "0.3"),
        Key("a.toml", "row.x", "5"),
    ]


TUNED, FORMAT = Row("tuned", "a book, p. 3"), Row("format")


def test_class_follows_a_file_renamed_and_a_constant_renamed() -> None:
    rows = {Key("a", "LIMIT", "0.3"): TUNED, Key("b", "OLD", "7"): FORMAT}
    now = [Key("new", "LIMIT", "0.3"), Key("b", "NAME", "7")]
    assert follow(now, rows) == {now[0]: TUNED, now[1]: FORMAT}


def test_class_does_not_follow_another_value_or_where_rows_differ() -> None:
    rows = {Key("a", "LIMIT", "0.3"): TUNED, Key("b", "LIMIT", "0.3"): FORMAT}
    now = [Key("c", "LIMIT", "0.3"), Key("a", "LIMIT", "0.4")]
    assert missing(now, follow(now, rows)) == sorted(now)


def test_row_of_a_whole_file_stands_for_its_numbers_while_there_are_some() -> None:
    rows = {Key("a.toml", "*", "*"): FORMAT}
    assert missing([Key("a.toml", "x", "3")], rows) == []
    assert stale([Key("a.toml", "x", "3")], rows) == []
    assert stale([Key("b.toml", "x", "3")], rows) == list(rows)


def test_table_is_read_as_it_was_written_and_refused_where_damaged(tmp_path: Path) -> None:
    table = tmp_path / "classes.tsv"
    rows = {Key("a", "f", "3"): TUNED, Key("a", "f", "4"): Row("?")}
    write(rows, table)
    assert read(table) == rows
    table.write_text(table.read_text().replace("tuned", "guessed"))
    with pytest.raises(ValueError, match="line 2"):
        read(table)


def test_draw_is_of_what_tunes_nothing_and_repeats() -> None:
    keys = [Key("a", "f", str(k)) for k in range(3, 60)]
    rows = {key: FORMAT if k % 2 else TUNED for k, key in enumerate(keys)}
    first = drawn(keys, rows, 10, 1)
    assert first == drawn(keys, rows, 10, 1) != drawn(keys, rows, 10, 2)
    assert len(set(first)) == 10
    assert {rows[key] for key in first} == {FORMAT}
    fixed = dict.fromkeys(keys, Row("format", "a specification"))
    assert drawn(keys, fixed, 10, 1) == []


def test_change_is_a_fifth_and_a_whole_number_stays_whole() -> None:
    assert [changed(x) for x in (10, 3, -3, 100)] == [12, 4, -4, 120]
    assert changed(0.5) == pytest.approx(0.6)
    assert [changed(x, 0.5) for x in (10, 2, -3)] == [5, 1, -2]
    assert [changed(0.95, by) for by in (1.2, 2.0)] == pytest.approx([0.94, 0.9])  # no 1.14


@pytest.mark.parametrize(("file", "name", "value", "case", "kept"), [
    ("constants", "GRAVITY_MPS2", "9.80665", "trainer-pitch-aircraft", False),  # moves all
    ("progress", "_WIDTH", "32", "trainer-pitch-aircraft", True),  # width of a bar
    ("reconstruction", "VANE_MODEL_SD", "0.006", "trainer-pitch-aircraft", True),  # as its room
    ("foreign.toml", "error.pot_scale.sigma", "0.03", "twin-multisine", False),  # read as text
])  # fmt: skip
def test_changed_number_moves_an_answer_only_if_it_acts(
    file: str, name: str, value: str, case: str, kept: bool
) -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as fresh:  # this one has imported the package
        moved, imported = fresh.submit(changed_case, Key(file, name, value), case).result()
    assert imported == ([] if file.endswith(".toml") else [file])
    assert (not moved) is kept


def changed_case(key: Key, case: str) -> tuple[list[str], list[str]]:
    """Return what moves in a case with a number changed, and the files changed."""
    finder = change_numbers([key])
    return answers([case])[case]["lines"], sorted(finder.imported)
