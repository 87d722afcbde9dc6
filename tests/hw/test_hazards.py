"""Every hazard names tests that exist; a row without one, or with one that is gone, is found."""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


def load_generator() -> ModuleType:
    """Load the program of hw/, which is no package."""
    spec = importlib.util.spec_from_file_location(
        "hw_generate_hazards", ROOT / "hw" / "generate_hazards.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


GENERATOR = load_generator()
TEXT = GENERATOR.TABLE.read_text(encoding="utf-8")
FAULTS = "tests/chip/flight/faults"


def missing(name: str, root: Path = ROOT) -> str:
    """Return what is wrong with the name of a test; empty if it exists."""
    place, separator, title = name.partition("::")
    if not separator:
        return f"{name}: expected path::name"
    path = root / place
    if place == FAULTS:
        rows = {text for file in path.glob("*.py") for text in _texts(file)}
        return "" if title in rows else f"{name}: no such row of make faults"
    if not path.is_file():
        return f"{name}: no file {place}"
    if path.suffix == ".py":
        return "" if title in _functions(path) else f"{name}: no such test in {place}"
    cases = re.findall(r'TEST_CASE\(\s*"((?:[^"\\]|\\.)*)"', path.read_text(encoding="utf-8"))
    return "" if title in cases else f"{name}: no such TEST_CASE in {place}"


def _texts(path: Path) -> Iterator[str]:
    """First text of every call: what a row of the table of faults is called by."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            words = [arg.value for arg in node.args[:2] if isinstance(arg, ast.Constant)]
            yield from (word for word in words if isinstance(word, str))


def _functions(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    return {name for name in names if name.startswith("test_")}


def test_every_named_test_exists() -> None:
    names = [name for hazard in GENERATOR.load(TEXT) for name in hazard.shown_by]
    assert len(names) > 80
    assert [told for told in map(missing, names) if told] == []


def test_the_page_is_current() -> None:
    assert GENERATOR.PAGE.read_text(encoding="utf-8") == GENERATOR.page(GENERATOR.load(TEXT))


@pytest.mark.parametrize(
    "name",
    [
        "tests/chip/flight/test_failsafe.py::test_that_is_gone",
        "tests/chip/flight/test_gone.py::test_program_that_hangs_lets_go_within_50_ms",
        "tests/chip/flight/test_failsafe.py::_helper",
        "tests/firmware/test_drive/test_drive.cpp::a case that is gone",
        "tests/chip/flight/faults::a fault that is gone",
        "tests/chip/flight/test_failsafe.py",
    ],
)
def test_a_test_that_is_gone_is_found(name: str) -> None:
    assert missing(name).startswith(name)


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        (r"shown_by = \[[^\]]*\]", "shown_by = []", "C1: shown_by is empty"),
        (r"shown_by = \[[^\]]*\]\n", "", "C1: found"),
        (r'bench = "[^"]*"', 'bench = ""', "C1: bench is empty"),
        (r'id = "C2"', 'id = "C1"', "C1: expected an id of its own"),
        (r'id = "C1"', 'id = "X1"', "X1: expected an id"),
        (r'cause = "[^"]*"', 'why = "x"', "C1: found"),
    ],
)
def test_a_row_that_is_not_whole_is_refused(before: str, after: str, complaint: str) -> None:
    broken = re.sub(before, after, TEXT, count=1)
    assert broken != TEXT
    with pytest.raises(GENERATOR.HazardError, match=re.escape(complaint)):
        GENERATOR.load(broken)
