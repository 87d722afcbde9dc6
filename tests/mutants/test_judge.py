"""The judge of mutants: what fails is killed, what compiles alike does not count."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import pytest

from tests.mutants import judge
from tests.mutants.__main__ import FILES

SOURCE = """\
#include <stdint.h>
// A comment.
uint8_t at_most(uint8_t value, uint8_t most) {
  return value > most ? most : value;
}
uint8_t unused_by_the_suite(uint8_t value) {
  return value + 3;
}
"""
SUITE = """\
#include <stdint.h>

#include "check.h"
uint8_t at_most(uint8_t value, uint8_t most);
TEST_CASE("no more than the most") {
  CHECK_EQ(at_most(7, 5), 5);
  CHECK_EQ(at_most(3, 5), 3);
}
"""
MORE = """\
uint8_t unused_by_the_suite(uint8_t value);
TEST_CASE("three more") { CHECK_EQ(unused_by_the_suite(4), 7); }
"""


@pytest.fixture(scope="module")
def main_object(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """doctest's own code, which every judge compiles for itself: 2 s each."""
    target = tmp_path_factory.mktemp("main") / "check_main.o"
    assert judge.Judge._compile(judge.SUITES / "check_main.cpp", target, judge.MAIN)
    return target


@pytest.fixture
def tree(tmp_path: Path, main_object: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A core of one file and its suite."""
    compile_one = judge.Judge._compile

    def compiled(source: Path, target: Path, flags: tuple[str, ...]) -> bool:
        if source.name == "check_main.cpp":
            return bool(shutil.copy(main_object, target))
        return compile_one(source, target, flags)

    monkeypatch.setattr(judge.Judge, "_compile", staticmethod(compiled))
    core, suites = tmp_path / "core", tmp_path / "suites"
    (suites / "test_clamp").mkdir(parents=True)
    core.mkdir()
    shutil.copy(judge.SUITES / "check_main.cpp", suites)
    (core / "clamp.cpp").write_text(SOURCE)
    shutil.copy(judge.SUITES / "check.h", suites)
    here = f"-I{tmp_path}"
    monkeypatch.setattr(judge, "PLAIN", (here, *judge.PLAIN))
    monkeypatch.setattr(judge, "SANITIZED", (here, *judge.SANITIZED))
    (suites / "test_clamp" / "test_clamp.cpp").write_text(SUITE)
    monkeypatch.setattr(judge, "FIRMWARE", tmp_path)
    monkeypatch.setattr(judge, "SUITES", suites)
    return tmp_path


def mutant(before: str, after: str) -> judge.Mutant:
    """Change the source in one place."""
    assert before in SOURCE
    return judge.Mutant(SOURCE.replace(before, after), 1, before, after)


def test_verdicts(tree: Path) -> None:
    folder = tree / "out"
    folder.mkdir()
    one = judge.Judge("core/clamp.cpp", ("test_clamp",), folder)
    seen: dict[str, str] = {}
    changes = {
        "less": ("value > most", "value < most"),
        "endless": ("  return value > most", "  for (;;) value++;\n  return value > most"),
        "gone": ("uint8_t at_most(", "uint8_t other("),
        "comment": ("// A comment.", "// Another."),
        "nonsense": ("value > most", "value >< most"),
        "untested": ("value + 3", "value + 4"),
        "again": ("value + 3", "4 + value"),
    }
    told = {name: one.verdict(mutant(*change), seen) for name, change in changes.items()}
    assert told == {
        "less": judge.KILLED,
        "endless": judge.KILLED,
        "gone": judge.KILLED,
        "comment": judge.SAME,
        "nonsense": judge.INVALID,
        "untested": judge.SURVIVED,
        "again": judge.SAME,
    }


HEADER = """\
#pragma once
#include <stdint.h>
inline uint8_t at_most(uint8_t value, uint8_t most) {
  return value > most ? most : value;
}
"""


def test_a_header_is_judged_by_the_suite_that_includes_it(tree: Path) -> None:
    (tree / "drivers").mkdir()
    (tree / "drivers" / "clamp.h").write_text(HEADER)
    suite = tree / "suites" / "test_clamp" / "test_clamp.cpp"
    declared = "uint8_t at_most(uint8_t value, uint8_t most);\n"
    suite.write_text(SUITE.replace(declared, '#include "drivers/clamp.h"\n'))
    (folder := tree / "out").mkdir()
    one = judge.Judge("drivers/clamp.h", ("test_clamp",), folder)
    changes = {
        "less": ("value > most", "value < most"),
        "nonsense": ("value > most", "value >< most"),
        "or equal": ("value > most", "value >= most"),
        "wide": ("? most :", "? most + 0 :"),
    }
    told = {
        name: one.verdict(judge.Mutant(HEADER.replace(*change), 1, *change), {})
        for name, change in changes.items()
    }
    assert told == {
        "less": judge.KILLED,
        "nonsense": judge.INVALID,
        "or equal": judge.SAME,
        "wide": judge.SAME,
    }


def test_what_does_not_include_a_header_is_compiled_once(tree: Path) -> None:
    (tree / "drivers").mkdir()
    (tree / "drivers" / "clamp.h").write_text(HEADER)
    suite = tree / "suites" / "test_clamp" / "test_clamp.cpp"
    declared = "uint8_t at_most(uint8_t value, uint8_t most);\n"
    suite.write_text(SUITE.replace(declared, '#include "drivers/clamp.h"\n'))
    other = '#include "check.h"\nTEST_CASE("another") { CHECK_EQ(1, 1); }\n'
    suite.with_name("other.cpp").write_text(other)
    (folder := tree / "out").mkdir()
    one = judge.Judge("drivers/clamp.h", ("test_clamp",), folder, tree / "shared")
    assert one._including == [suite]
    before = {path.name for path in (tree / "shared").iterdir()}
    assert one.verdict(judge.Mutant(HEADER.replace("> most", "< most"), 1, "", ""), {}) == "killed"
    assert {path.name for path in (tree / "shared").iterdir()} == before
    suite.write_text(SUITE)
    with pytest.raises(judge.MutantError, match="none of test_clamp includes it"):
        judge.Judge("drivers/clamp.h", ("test_clamp",), folder, tree / "shared")


def test_a_file_that_fails_its_own_suite_is_refused(tree: Path) -> None:
    (tree / "core" / "clamp.cpp").write_text(SOURCE.replace("value > most", "value < most"))
    folder = tree / "out"
    folder.mkdir()
    with pytest.raises(judge.MutantError, match="its own suite fails"):
        judge.Judge("core/clamp.cpp", ("test_clamp",), folder)


def test_a_run_goes_on_and_survivors_are_judged_again_by_a_new_suite(tree: Path) -> None:
    few = judge.judge_file("core/clamp.cpp", ("test_clamp",), jobs=1, most=3, out=tree / "notes")
    assert few.judged == f"3 of {few.made}"
    first = judge.judge_file("core/clamp.cpp", ("test_clamp",), jobs=1, out=tree / "notes")
    assert first.judged == "all"
    assert first.count(judge.KILLED) > 3
    assert any("value + 3" in one.was for one in first.survivors)
    suite = tree / "suites" / "test_clamp" / "test_clamp.cpp"
    suite.write_text(SUITE + MORE)
    second = judge.judge_file("core/clamp.cpp", ("test_clamp",), jobs=1, out=tree / "notes")
    assert second.share > first.share
    assert not any("value + 3" in one.was for one in second.survivors)


def test_what_is_proved_the_same_program_does_not_count(
    tree: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    proofs = tree / "proofs.toml"
    proofs.write_text("proof = []")
    monkeypatch.setattr(judge, "PROOFS", proofs)
    one = ("core/clamp.cpp", ("test_clamp",))
    before = judge.judge_file(*one, jobs=1, out=tree / "notes")
    left = next(mutant for mutant in before.survivors if mutant.was.startswith("return"))
    row = f"""\
[[proof]]
file = "core/clamp.cpp"
line = {left.line}
was = "{left.was}"
now = ["{left.now}"]
"""
    proofs.write_text(row)
    after = judge.judge_file(*one, jobs=1, out=tree / "notes")
    assert (before.proved, after.proved) == (0, 1)
    assert after.counted == before.counted - 1
    assert left not in after.survivors
    proofs.write_text(row.replace(f"line = {left.line}", "line = 1"))
    with pytest.raises(judge.MutantError, match="is of no mutant"):
        judge.judge_file(*one, jobs=1, out=tree / "notes")


def test_each_proof_stands_at_its_line_and_says_why() -> None:
    for row in tomllib.loads(judge.PROOFS.read_text(encoding="utf-8"))["proof"]:
        assert row["file"] in FILES
        lines = (judge.FIRMWARE / row["file"]).read_text(encoding="utf-8").splitlines()
        if row["was"]:
            assert lines[row["line"] - 1].strip() == row["was"], row
        assert row["now"]
        assert len(row["because"].split()) >= 4, row
